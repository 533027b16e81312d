"""Prior on a hand's motion: a Gaussian process of its postures, learned from the capture.

The principal components of the angles are independent processes with the spectrum 1 / (1 + (l w)^4). That is the prior
whose energy is the integral of x^2 + (l^2 x'')^2: postures are pulled to the mean, and accelerations are small. Its
variance and its time constant l are those of the capture. In frames it couples only three in a row.
"""

from dataclasses import dataclass

import numpy as np

from depthtrack.hand.pose import ANGLES
from depthtrack.hand.synergies import load_synergies
from depthtrack.markers.filling.options import SmoothFillOptions
from depthtrack.types import Array, Mask

_STEP = 0.05
"""Half the time over which velocities are taken, seconds."""
_DATABASE_TIME_CONSTANT = 0.2
"""Standard deviation of angles over that of their velocity in natural motions, seconds."""


@dataclass(frozen=True, eq=False)
class MotionPrior:
    """Precisions of the prior of one frame.

    mean: (26,) of the angles, rad; zero for the palm.
    posture: (26, 26) precision of the tangent from the mean.
    acceleration: (26, 26) precision of its second differences.
    """

    mean: Array
    posture: Array
    acceleration: Array


def learn_motion_prior(poses: Array, known: Mask, rate: float, options: SmoothFillOptions) -> MotionPrior:
    """Return the prior of a capture.

    poses: (T, 27) capture frame.
    known: (T, 26) whether a frame determines a parameter.
    rate: frames a second, Hz.
    """
    usable = known.any(axis=0)
    whole = np.asarray(known[:, usable].all(axis=1) & np.isfinite(poses).all(axis=1))
    mean, covariance = _postures(poses[whole, ANGLES], rate, options)
    variances, axes = np.linalg.eigh(covariance)
    constants = options.time_scale * _time_constants(poses[:, ANGLES] @ axes, whole, variances, rate, options)
    # The variance of the process is its density over 2 sqrt(2) l.
    density = 2 * np.sqrt(2) * constants * variances * rate
    posture, acceleration = np.zeros((26, 26)), np.zeros((26, 26))
    posture[6:, 6:] = axes / density @ axes.T
    acceleration[6:, 6:] = axes * ((constants * rate) ** 4 / density) @ axes.T
    for rows, spread in ((slice(0, 3), options.palm_acceleration), (slice(3, 6), options.palm_turn)):
        np.fill_diagonal(acceleration[rows, rows], rate**3 / (spread**2 * 2 * _STEP))
    return MotionPrior(np.concatenate([np.zeros(6), mean]), posture, acceleration)


def _postures(angles: Array, rate: float, options: SmoothFillOptions) -> tuple[Array, Array]:
    """Return mean (20,) and covariance (20, 20) of postures; recorded ones are the prior."""
    recorded = load_synergies()
    share = len(angles) / (len(angles) + options.database_time * rate)
    mean = recorded.mean if len(angles) == 0 else share * angles.mean(axis=0) + (1 - share) * recorded.mean
    covariance = (1 - share) * (recorded.components * recorded.variances @ recorded.components.T)
    if len(angles) > 0:
        covariance = covariance + share * ((angles - mean).T @ (angles - mean) / len(angles))
    return np.asarray(mean), covariance + options.angle_noise**2 * np.eye(20)


def _time_constants(
    coordinates: Array, whole: Mask, variances: Array, rate: float, options: SmoothFillOptions
) -> Array:
    """Return the standard deviation of each component (20,) over that of its velocity, seconds."""
    step = max(round(_STEP * rate), 1)
    pairs = np.flatnonzero(whole[2 * step :] & whole[: -2 * step])
    velocities = (coordinates[pairs + 2 * step] - coordinates[pairs]) * (rate / (2 * step))
    share = len(pairs) / (len(pairs) + options.database_time * rate)
    squared = (1 - share) * variances / _DATABASE_TIME_CONSTANT**2
    if len(pairs) > 0:
        squared = squared + share * np.mean(velocities**2, axis=0)
    return np.asarray(np.sqrt(variances / squared))
