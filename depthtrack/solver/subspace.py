"""The parameters a solver moves: all 26, or the global pose and a few synergies (Schroeder et al. 2014, Sec. V-A)."""

from typing import NamedTuple

import numpy as np

from depthtrack.hand.limits import LOWER, UPPER
from depthtrack.hand.synergies import Synergies
from depthtrack.types import Array


class PostureSubspace(NamedTuple):
    """Finger angles as `mean` (20,) + `basis` (20, l) @ coordinates (l,): Eq. (6) and (7), less the global pose, which
    no basis changes. `lower`, `upper` (l,) are the coordinates' limits; `full` tells the plain angles (basis: I)."""

    basis: Array
    mean: Array
    lower: Array
    upper: Array
    full: bool

    @staticmethod
    def of(synergies: Synergies, count: int | None = None) -> "PostureSubspace":
        """The global pose and the first `count` synergies, or all of them. Raises InputError if there are fewer."""
        s = synergies if count is None else synergies.truncated(count)
        return PostureSubspace(
            np.ascontiguousarray(s.components), np.array(s.mean), np.array(s.lower), np.array(s.upper), False
        )

    def project(self, angles: Array) -> Array:
        """Coordinates (l,) of the nearest angles that the space holds, moved within the limits."""
        return np.clip((angles - self.mean) @ self.basis, self.lower, self.upper)

    def angles(self, coordinates: Array) -> Array:
        """Angles (20,) at coordinates (l,)."""
        return self.mean + self.basis @ coordinates


FULL = PostureSubspace(np.eye(20), np.zeros(20), np.array(LOWER), np.array(UPPER), True)
"""All twenty angles within the hand's limits."""
