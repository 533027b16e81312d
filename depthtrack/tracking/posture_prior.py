"""The prior of a fit on the finger angles: they move together as in common postures.

Depth alone does not place hidden fingers. They follow the visible ones as in recorded postures (Schroeder et al. 2014,
Sec. V), and return slowly to the mean posture. The points of visible fingers outweigh the prior.
"""

from dataclasses import replace
from functools import cache

from depthtrack.hand.common_postures import common_postures
from depthtrack.hand.shape import CALIBRATED, HandShape
from depthtrack.solver.options import IcpOptions, SurfaceFitOptions
from depthtrack.solver.prior import Prior
from depthtrack.types import Array

_EXACT_SHARE = 1 / 3
"""Share of the prior's weight for a hand whose sizes are exact."""


def for_hand(options: SurfaceFitOptions, hand: HandShape) -> SurfaceFitOptions:
    """Return the options of a fit with the weights of posture and keypoints for a hand.

    Those of the options are for a calibrated hand. Points count more beside the prior if the sizes are exact.
    """
    share = min(max(hand.uncertainty / CALIBRATED, _EXACT_SHARE), 1.0)
    if share == 1 or options.icp.posture_weight == 0:
        return options
    weights = share * options.icp.posture_weight, share * options.icp.keypoint_weight
    return replace(options, icp=replace(options.icp, posture_weight=weights[0], keypoint_weight=weights[1]))


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
