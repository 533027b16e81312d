"""What draws finger angles that the observation says little of: those of a moment ago, or likely ones."""

from typing import NamedTuple

import numpy as np

from depthtrack.hand.synergies import Synergies
from depthtrack.types import Array

_RESIDUAL_SPREAD = np.radians(2.0)
"""How far postures usually lie from what a few synergies make of them: standard deviation of an angle."""


class Prior(NamedTuple):
    """A pull of the finger angles x towards `mean` (20,): (x - rest)^T `precision` (x - rest) is added to the squared
    distances. `precision` (20, 20) is in m^2/rad^2 beside the sum over 3000 points."""

    precision: Array
    mean: Array

    @staticmethod
    def none() -> "Prior":
        """No pull at all."""
        return Prior(np.zeros((20, 20)), np.zeros(20))

    @staticmethod
    def towards(angles: Array, strength: float) -> "Prior":
        """Towards these angles (20,), alike for all of them: `strength` m^2/rad^2."""
        return Prior(strength * np.eye(20), angles.copy())

    @staticmethod
    def synergy_weight(synergies: Synergies, strength: float) -> "Prior":
        """Towards postures that are common among those of the synergies.

        They are taken as probabilistic principal components (Tipping and Bishop, 1999): a normal distribution along
        each, and a little variance in all other directions. `strength` (m^2) is the variance of a point's distance
        for which the result is the likeliest pose.
        """
        C = synergies.components
        along = C * (1 / (synergies.variances + _RESIDUAL_SPREAD**2)) @ C.T
        across = (np.eye(20) - C @ C.T) / _RESIDUAL_SPREAD**2
        return Prior(strength * (along + across), synergies.mean.copy())

    def scaled(self, factor: float) -> "Prior":
        """The same pull, so many times as strong."""
        return Prior(factor * self.precision, self.mean)
