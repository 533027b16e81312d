"""Quadratic priors on the finger angles: towards given angles, or towards likely postures."""

from typing import NamedTuple

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.hand.common_postures import PostureDistribution
from depthtrack.hand.synergies import Synergies
from depthtrack.solver.subspace import PostureSubspace
from depthtrack.types import Array


class Prior(NamedTuple):
    """Quadratic prior on finger angles x: half of (x - mean)^T precision (x - mean).

    precision: (20, 20) m^2/rad^2, relative to half the sum of squared residuals.
    mean: (20,) rad.

    Trackers state the precision for 3000 points, and scale it by the number of points.
    """

    precision: Array
    mean: Array

    @staticmethod
    def none() -> "Prior":
        """Return the prior without effect."""
        return Prior(np.zeros((20, 20)), np.zeros(20))

    @staticmethod
    def towards(angles: Array, strength: float) -> "Prior":
        """Return the prior towards angles (20,), rad, of the same strength (m^2/rad^2) for each."""
        return Prior(strength * np.eye(20), angles.copy())

    @staticmethod
    def from_synergies(synergies: Synergies, strength: float, residual_spread: float = np.radians(2.0)) -> "Prior":
        """Return the prior towards postures that are common among those of the synergies.

        strength: variance of a residual for which the minimum is the likeliest pose, m^2.
        residual_spread: standard deviation of an angle from its reconstruction by a few synergies, rad.
        """
        mean, precision = PostureDistribution.of(synergies, residual_spread)
        return Prior(strength * precision, mean)

    def scaled(self, factor: float) -> "Prior":
        """Return the prior with its precision times `factor`."""
        return Prior(factor * self.precision, self.mean)


@compiled(nogil=True)
def reduced_precision(prior: Prior, space: PostureSubspace) -> Array:
    """Return the precision (l, 20) of the prior between the coordinates and the angles."""
    if space.full:
        return prior.precision
    count = space.basis.shape[1]
    pull = np.zeros((count, 20))
    for i in range(count):
        for k in range(20):
            for j in range(20):
                pull[i, j] += space.basis[k, i] * prior.precision[k, j]
    return pull


@compiled(nogil=True)
def prior_energy(pose: Array, prior: Prior) -> float:
    """Return the energy of the prior at a pose (27,), m^2."""
    total = 0.0
    for i in range(20):
        row = 0.0
        for j in range(20):
            row += prior.precision[i, j] * (pose[7 + j] - prior.mean[j])
        total += row * (pose[7 + i] - prior.mean[i])
    return 0.5 * total


@compiled(nogil=True)
def add_prior(pose: Array, prior: Prior, space: PostureSubspace, pull: Array, A: Array, b: Array) -> float:
    """Add the prior to the normal equations; return its energy, m^2.

    pull: `reduced_precision` of the prior.
    """
    count = pull.shape[0]
    for i in range(count):
        for j in range(20):
            b[6 + i] += pull[i, j] * (pose[7 + j] - prior.mean[j])
            if space.full:
                A[6 + i, 6 + j] += pull[i, j]
            else:
                for k in range(count):
                    A[6 + i, 6 + k] += pull[i, j] * space.basis[j, k]
    return prior_energy(pose, prior)
