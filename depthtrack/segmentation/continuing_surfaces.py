"""Surfaces that continue beyond the hand's reach, such as walls, tables and bodies.

The readings within the reach of a predicted hand include such surfaces. A hand ends within its reach, so a surface that
goes on beyond it is something else.
"""

import math

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.types import Depth, Labels, Mask

OUTSIDE, READING, MISSING, BEYOND_WRIST = 0, 1, 2, 3
"""Kinds of pixels: outside the hand's reach; a reading within it; no reading, but within it at the palm's depth; within
it, but beyond the wrist."""

LEAST_BORDER = 0.01
"""Metres: a shorter border in all is noise."""


def without_continuing_surfaces(
    depth: Depth, kinds: Labels, readings: Mask, focal_length: float, jump: float, border_share: float
) -> Mask:
    """Return `readings` (h, w) without the surfaces that continue beyond the hand's reach.

    depth: (h, w), metres.
    kinds: (h, w), see `OUTSIDE` to `BEYOND_WRIST`.
    focal_length: pixels.
    jump: largest depth step between connected neighbours, metres.
    border_share: longest border between a surface and its part beyond the reach, in square roots of the area within.
    """
    if _border(depth, kinds, readings, focal_length, jump) <= LEAST_BORDER:
        return readings
    kept = readings.copy()
    _remove(depth, kinds, kept, focal_length, jump, border_share)
    return kept


@compiled(nogil=True)
def _continues(depth: Depth, kinds: Labels, v: int, u: int, jump: float) -> int:
    """Return the number of neighbours outside the reach that continue the surface of a pixel."""
    count, z = 0, depth[v, u]
    for side in range(4):
        row, column = v + (side == 0) - (side == 1), u + (side == 2) - (side == 3)
        if 0 <= row < depth.shape[0] and 0 <= column < depth.shape[1] and kinds[row, column] == OUTSIDE:
            there = depth[row, column]
            count += there > 0.0 and abs(there - z) < jump
    return count


@compiled(nogil=True)
def _border(depth: Depth, kinds: Labels, readings: Mask, focal_length: float, jump: float) -> float:
    """Return the length of the border between readings and surfaces beyond the reach, m."""
    length, last = 0.0, depth.shape[1] - 1
    beside = np.empty(depth.shape[1], np.bool_)
    for v in range(depth.shape[0]):
        row, here = readings[v], kinds[v]
        above, below = kinds[max(v - 1, 0)], kinds[min(v + 1, depth.shape[0] - 1)]
        # Few readings lie beside pixels outside the reach: they are found without branches.
        found = row[0] | row[last]
        for u in range(1, last):
            around = (above[u] == OUTSIDE) | (below[u] == OUTSIDE) | (here[u - 1] == OUTSIDE) | (here[u + 1] == OUTSIDE)
            beside[u] = row[u] & around
            found |= beside[u]
        if not found:
            continue
        beside[0], beside[last] = row[0], row[last]
        for u in range(depth.shape[1]):
            if beside[u]:
                length += _continues(depth, kinds, v, u, jump) * depth[v, u] / focal_length
    return length


@compiled(nogil=True)
def _remove(depth: Depth, kinds: Labels, readings: Mask, focal_length: float, jump: float, border_share: float) -> None:
    """Remove the surfaces with too long a border to their part beyond the reach from `readings`."""
    height, width = depth.shape
    seen = np.zeros((height, width), np.bool_)
    rows, columns = np.empty(height * width, np.int32), np.empty(height * width, np.int32)
    for first_row in range(height):
        for first_column in range(width):
            if seen[first_row, first_column] or not readings[first_row, first_column]:
                continue
            rows[0], columns[0], count, at, border, area = first_row, first_column, 1, 0, 0.0, 0.0
            seen[first_row, first_column] = True
            while at < count:
                v, u = rows[at], columns[at]
                at += 1
                z = depth[v, u]
                side_length = z / focal_length
                border += _continues(depth, kinds, v, u, jump) * side_length
                area += side_length * side_length
                for side in range(4):
                    row, column = v + (side == 0) - (side == 1), u + (side == 2) - (side == 3)
                    if not (0 <= row < height and 0 <= column < width):
                        continue
                    if seen[row, column] or not readings[row, column] or abs(depth[row, column] - z) >= jump:
                        continue
                    seen[row, column] = True
                    rows[count], columns[count] = row, column
                    count += 1
            if border > border_share * math.sqrt(area):
                for i in range(count):
                    readings[rows[i], columns[i]] = False
