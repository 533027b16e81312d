"""The finger angles of common postures, as a normal distribution.

Its synergies are probabilistic principal components (Tipping and Bishop, 1999): each has its own variance, and all
other directions a common one.
"""

from functools import cache
from typing import NamedTuple

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.hand.synergies import Synergies, load_synergies
from depthtrack.types import Array

POSTURE_SPREAD = np.radians(14.0)
"""Standard deviation of an angle from its reconstruction by the synergies, rad."""


class PostureDistribution(NamedTuple):
    """Normal distribution of the finger angles.

    mean: (20,) rad.
    precision: (20, 20) 1/rad^2.
    """

    mean: Array
    precision: Array

    @staticmethod
    def of(synergies: Synergies, residual_spread: float) -> "PostureDistribution":
        """Return the distribution of postures that synergies describe.

        residual_spread: standard deviation of an angle from its reconstruction by them, rad.
        """
        C = synergies.components
        along = C * (1 / (synergies.variances + residual_spread**2)) @ C.T
        across = (np.eye(len(C)) - C @ C.T) / residual_spread**2
        return PostureDistribution(synergies.mean.copy(), along + across)


@cache
def common_postures() -> PostureDistribution:
    """Return the distribution of the recorded postures that the package holds."""
    return PostureDistribution.of(load_synergies(), POSTURE_SPREAD)


@compiled(nogil=True)
def add_posture_costs(poses: Array, mean: Array, precision: Array, weight: float, energies: Array) -> None:
    """Add `weight` times the squared distance of poses from common postures to energies.

    The distance is that of Mahalanobis, in standard deviations.

    poses, energies: (B, 27) and (B,).

    mean, precision: (20,) and (20, 20) of `PostureDistribution`.
    """
    away = np.empty(20)
    for n in range(poses.shape[0]):
        for i in range(20):
            away[i] = poses[n, 7 + i] - mean[i]
        total = 0.0
        for i in range(20):
            row = 0.5 * precision[i, i] * away[i]
            for j in range(i):
                row += precision[i, j] * away[j]
            total += row * away[i]
        energies[n] += 2.0 * weight * total
