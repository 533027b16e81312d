"""Even subsampling of points, such as the vertices of a skin."""

import numpy as np
from numpy.typing import NDArray

from depthtrack.compilation import compiled
from depthtrack.types import Array, Index

_MOST_CELLS = 100
"""Cells along the longest side of the points."""


def subsample_evenly(points: Array, spacing: float) -> Index:
    """Return increasing rows of points (N, 3) that are more than `spacing` (m) apart.

    A point is taken if no point taken before is within `spacing`.
    """
    low, extent = points.min(axis=0), np.ptp(points, axis=0)
    side = max(spacing, float(extent.max()) / _MOST_CELLS)
    # One empty cell on each side.
    cells = ((points - low) / side).astype(np.int64) + 1
    _, rows, columns = (extent / side).astype(np.int64) + 3
    places = (cells[:, 0] * rows + cells[:, 1]) * columns + cells[:, 2]
    is_taken = np.zeros(len(points), np.bool_)
    last = np.full(int(places.max()) + (rows + 1) * columns + 2, -1)
    _take(np.array(points), spacing, places, (rows, columns), last, is_taken)
    return np.flatnonzero(is_taken)


@compiled()
def _take(
    points: Array, spacing: float, places: Index, sides: tuple[int, int], last: Index, is_taken: NDArray[np.bool_]
) -> None:
    """Mark the points (N, 3) to take.

    places: (N,) cell of each point, of at least the side `spacing`.
    sides: numbers of cells along the last two axes.
    last: a number for each cell, -1; then the last point taken in it.
    """
    before = np.empty(len(points), np.int64)
    for n in range(len(points)):
        is_free = True
        for k in range(27):
            other = last[places[n] + ((k // 9 - 1) * sides[0] + k // 3 % 3 - 1) * sides[1] + k % 3 - 1]
            while is_free and other >= 0:
                x, y, z = (
                    points[n, 0] - points[other, 0],
                    points[n, 1] - points[other, 1],
                    points[n, 2] - points[other, 2],
                )
                is_free = x * x + y * y + z * z > spacing * spacing
                other = before[other]
        if is_free:
            before[n], last[places[n]] = last[places[n]], n
            is_taken[n] = True
