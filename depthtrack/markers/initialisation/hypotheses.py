"""A hypothesis: a model with assigned points, its fit and its energy."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from depthtrack.types import Array, Index


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A model with assigned points.

    points: (M,) point of each marker, -1 for none.
    energy: of the fit, and of the markers without a point; see `models.sized_fit`.
    pose: (27,).
    sizes: (35,) of the hand, relative to those of the model.
    """

    points: Index
    energy: float
    pose: Array
    sizes: Array

    def renumbered(self, numbers: Index) -> "Hypothesis":
        """Return the hypothesis with point k called `numbers[k]`."""
        return replace(self, points=np.where(self.points >= 0, numbers[self.points], -1))

    @property
    def key(self) -> bytes:
        """The assignment as a dictionary key."""
        return self.points.tobytes()


def unique(found: Iterable[Hypothesis]) -> list[Hypothesis]:
    """Return the best hypothesis of each assignment."""
    best: dict[bytes, Hypothesis] = {}
    for h in found:
        if h.key not in best or h.energy < best[h.key].energy:
            best[h.key] = h
    return list(best.values())
