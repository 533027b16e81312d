"""Greedy choice of Schroeder et al. 2015, Sec. 6, evaluated as the paper describes it."""

from dataclasses import dataclass, fields

import numpy as np

from depthtrack.markers.layout.quality import LayoutQuality
from depthtrack.markers.layout.surface_swarm import FoundLayout
from depthtrack.types import Array, Index

_LEAST_GAIN = 1e-12
"""Relative decrease of the energy that a replacement must bring."""
_BLOCK = 8
"""Vertices that are evaluated at a time until one is better."""


@dataclass(frozen=True, eq=False)
class WholeEvaluation(LayoutQuality):
    """The objective without sums and bounds.

    Each layout is evaluated from its markers, and to the end.

    evaluated: (1,) number of layouts so far.
    """

    evaluated: Index

    @staticmethod
    def like(quality: LayoutQuality) -> "WholeEvaluation":
        """Return the same objective."""
        same = {each.name: getattr(quality, each.name) for each in fields(LayoutQuality)}
        return WholeEvaluation(**same, evaluated=np.zeros(1, np.int64))

    def energies(self, layouts: Index, bounds: Array | None = None, pool: object = None) -> Array:
        self.evaluated[0] += len(layouts)
        return LayoutQuality.energies(self, layouts)

    def grown(self, base: Index, bound: float = np.inf, pool: object = None) -> Array:
        count = len(self.candidates)
        found = self.energies(np.column_stack([np.tile(base, (count, 1)), np.arange(count)]))
        found[base] = np.inf
        return found


def next_better(quality: WholeEvaluation, start: Index) -> FoundLayout:
    """Return the layout whose markers have no better vertex, reached from `start` (K,).

    Each marker in turn is moved to the next vertex with a lower energy. This is another reading of "replaced by the
    next better remaining vertex position" than the best vertex.
    """
    layout, count = np.array(start, dtype=np.int64), len(quality.candidates)
    energy, tried, k = float(quality.energies(layout[None])[0]), 0, 0
    while tried < len(layout):
        tried += 1
        others = np.roll(np.arange(count), -layout[k] - 1)[:-1]
        for first in range(0, len(others), _BLOCK):
            vertices = others[first : first + _BLOCK]
            changed = np.repeat(layout[None], len(vertices), axis=0)
            changed[:, k] = vertices
            found = quality.energies(changed)
            better = np.flatnonzero(found < energy - _LEAST_GAIN * abs(energy))
            if len(better):
                layout, energy, tried = changed[better[0]], float(found[better[0]]), 1
                break
        k = (k + 1) % len(layout)
    return FoundLayout(layout, energy)
