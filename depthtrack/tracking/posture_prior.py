"""The prior of a fit on the finger angles: they move together as in common postures.

Depth alone does not place hidden fingers. They follow the visible ones as in recorded postures (Schroeder et al. 2014,
Sec. V), and return slowly to the mean posture. The points of visible fingers outweigh the prior.
"""

from functools import cache

from depthtrack.hand.common_postures import common_postures
from depthtrack.solver.options import IcpOptions
from depthtrack.solver.prior import Prior
from depthtrack.types import Array


@cache
def posture_prior() -> Prior:
    """Return the prior of the common postures, of strength 1 m^2."""
    mean, precision = common_postures()
    return Prior(precision, mean)


def prior_near(angles: Array, kept: float, options: IcpOptions) -> Prior:
    """Return the prior near angles (20,), rad.

    kept: share that is kept of their distance from the mean posture, as in an Ornstein-Uhlenbeck process.

    Without a `posture_weight` each angle is held alone.
    """
    if options.posture_weight == 0:
        return Prior.towards(angles, options.temporal_weight)
    common = posture_prior()
    return Prior(options.posture_weight * common.precision, common.mean + kept * (angles - common.mean))
