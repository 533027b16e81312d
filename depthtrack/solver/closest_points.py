"""Search for the visible point closest to each observed point, sixteen at a time.

Observed points are sorted by cell once. Sixteen neighbours in a row of cells search the visible points of their cells
and of those around. The few that have none near search larger squares of cells.
"""

import math
from typing import NamedTuple

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.simd.functions import lowest_of_halves
from depthtrack.simd.vectors import F32X16, both, filler, kernel_part, loader, select, store
from depthtrack.solver.visible_points import FAR, LANES, Cells
from depthtrack.types import Array, Array32, Index

_WIDEST = 12
"""Cells of a row that a group of points spans at most."""
_FIRST_RING = 3
"""Cells on each side of its own that are searched first for a point that has no visible point beside it."""
_LANE: Array32 = np.arange(LANES, dtype=np.float32)

_load = loader(F32X16)
_fill = filler(F32X16)


class Groups(NamedTuple):
    """Observed points sorted by cell, in groups of at most `LANES` points of a row of cells.

    first: (G + 1,) group g has the sorted points from first[g] up to first[g + 1].
    cells: (G, 3) row, and first and last column of the cells of a group.
    place: (3, N + LANES) metres, relative to the origin.
    normals: (3, N + LANES) unit.
    margin: (N,) distance to the nearest cell that is not beside the point's own, metres.
    best, chosen: working memory: twice (N + LANES,) the squared distance of the closest visible point, and its row.
    """

    first: Index
    cells: Index
    place: Array32
    normals: Array32
    margin: Array
    best: Array32
    chosen: Array32

    def with_own_memory(self) -> "Groups":
        """Return the groups with other working memory."""
        return self._replace(best=np.zeros_like(self.best), chosen=np.zeros_like(self.chosen))


def grouped(points: Array, normals: Array, cells: Cells, origin: Array) -> tuple[Array, Array, Groups]:
    """Return the sorted points and normals (N, 3) of a cloud, and their groups among cells.

    origin: (3,) metres, camera frame, of the visible points.
    """
    points, normals, *found = _grouped(points, normals, cells, origin)
    return points, normals, Groups(*found)


@compiled(nogil=True)
def _grouped(points, normals, cells, origin):
    count = points.shape[0]
    cell, slots = np.empty((count, 2), np.int64), np.zeros(cells.rows * cells.columns + 1, np.int64)
    inside = np.empty(count)
    for i in range(count):
        cell[i, 0], cell[i, 1], inside[i] = place_in_cell(cells, points[i, 0], points[i, 1], points[i, 2])
        slots[cell[i, 1] * cells.columns + cell[i, 0] + 1] += 1
    for c in range(1, slots.shape[0]):
        slots[c] += slots[c - 1]
    order = np.empty(count, np.int64)
    for i in range(count):
        slot = cell[i, 1] * cells.columns + cell[i, 0]
        order[slots[slot]] = i
        slots[slot] += 1
    first, span, total = np.zeros(count + 1, np.int64), np.empty((count, 3), np.int64), 0
    place, sorted_normals = np.zeros((3, count + LANES), np.float32), np.zeros((3, count + LANES), np.float32)
    sorted_points, cloud_normals = np.empty((count, 3)), np.empty((count, 3))
    margin, slant = np.empty(count), _slant(cells)
    for j in range(count):
        i = order[j]
        column, row = cell[i, 0], cell[i, 1]
        begun = first[total - 1] if total > 0 else 0
        if total == 0 or row != span[total - 1, 0] or j - begun == LANES or column - span[total - 1, 1] >= _WIDEST:
            first[total] = j
            span[total, 0], span[total, 1] = row, column
            total += 1
        span[total - 1, 2] = column
        margin[j] = max(1.0 + inside[i], 0.0) * (cells.size * points[i, 2] * slant)
        for k in range(3):
            sorted_points[j, k], cloud_normals[j, k] = points[i, k], normals[i, k]
            place[k, j], sorted_normals[k, j] = points[i, k] - origin[k], normals[i, k]
    first[total] = count
    memory = np.zeros((2, count + LANES), np.float32)
    ends, cells_of = first[: total + 1].copy(), span[:total].copy()
    return sorted_points, cloud_normals, ends, cells_of, place, sorted_normals, margin, memory[0], memory[1]


@compiled(nogil=True)
def place_in_cell(cells, x, y, z):
    """Return column and row of a point, and its distance from the sides of its cell, in cells."""
    p, q = (x / z - cells.u) / cells.size, (y / z - cells.v) / cells.size
    column, row = min(max(int(p), 0), cells.columns - 1), min(max(int(q), 0), cells.rows - 1)
    return column, row, min(p - column, column + 1 - p, q - row, row + 1 - q)


@compiled(nogil=True)
def _slant(cells):
    """Return the smallest ratio of the distance between two rays to that in the image plane.

    Rays through image points that are d apart pass a point at depth z no closer than d z / |(u, v, 1)|.
    """
    u = max(abs(cells.u), abs(cells.u + cells.columns * cells.size))
    v = max(abs(cells.v), abs(cells.v + cells.rows * cells.size))
    return 1.0 / math.sqrt(1.0 + u * u + v * v)


@kernel_part
def closest_vertices(cloud, groups, visible, cells, max_distance, min_normal_cosine, closest):
    """Write the row of the visible point closest to each observed point to `closest`.

    cloud: N observed points and normals in the order of their groups, camera frame.
    visible: visible points sorted by cell, relative to the origin of the groups.
    max_distance: largest distance, m.
    min_normal_cosine: smallest cosine between the normals.
    closest: (N,) rows of `visible`, -1 for none.
    """
    first, table = visible.first, visible.table
    limit, least = np.float32(max_distance * max_distance), np.float32(min_normal_cosine)
    for g in range(groups.cells.shape[0]):
        row, low, high = groups.cells[g, 0], groups.cells[g, 1], groups.cells[g, 2]
        left, right, at = max(low - 1, 0), min(high + 1, cells.columns - 1), groups.first[g]
        px, py, pz = _load(groups.place[0], at), _load(groups.place[1], at), _load(groups.place[2], at)
        mx, my, mz = _load(groups.normals[0], at), _load(groups.normals[1], at), _load(groups.normals[2], at)
        best, chosen = _fill(limit), _fill(FAR)
        for r in range(max(row - 1, 0), min(row + 1, cells.rows - 1) + 1):
            base = r * cells.columns
            for k in range(first[base + left], first[base + right + 1]):
                dx, dy, dz = table[0, k] - px, table[1, k] - py, table[2, k] - pz
                d = dx * dx + dy * dy + dz * dz
                same = table[3, k] * mx + table[4, k] * my + table[5, k] * mz
                better = both(d < best, same >= least)
                best, chosen = select(better, d, best), select(better, np.float32(k), chosen)
        # Lanes beyond the group are those of the next one, which writes them again.
        store(groups.best, at, best)
        store(groups.chosen, at, chosen)
    slant = _slant(cells)
    for j in range(cloud.points.shape[0]):
        nearest = groups.chosen[j]
        if groups.margin[j] * groups.margin[j] < groups.best[j]:
            nearest = _search_beyond(groups, j, cloud.points[j], visible, cells, least, slant)
        closest[j] = int(nearest) if nearest < FAR else -1


@kernel_part
def _search_beyond(groups, j, point, visible, cells, least, slant):
    """Return the row of the visible point closest to sorted point j, or FAR for none.

    The cells beside its own have been searched. The search goes on in a square of cells that reaches as far as the
    closest point so far. If there is none, it begins in a small square. The cells of a row are contiguous in memory. A
    load of sixteen points may include further cells, whose points are valid too.
    """
    first, table = visible.first, visible.table
    px, py, pz = groups.place[0, j], groups.place[1, j], groups.place[2, j]
    mx, my, mz = groups.normals[0, j], groups.normals[1, j], groups.normals[2, j]
    column, row, inside = place_in_cell(cells, point[0], point[1], point[2])
    side, widest = cells.size * point[2] * slant, max(cells.columns, cells.rows)
    lanes, lowest = _load(_LANE, 0), groups.best[j]
    best, chosen = _fill(lowest), _fill(FAR)
    ring = min(int(math.sqrt(lowest) / side - inside) + 1, widest)
    if groups.chosen[j] >= FAR:
        ring = min(ring, _FIRST_RING)
    while True:
        left, right = max(column - ring, 0), min(column + ring, cells.columns - 1)
        for r in range(max(row - ring, 0), min(row + ring, cells.rows - 1) + 1):
            base = r * cells.columns
            for k in range(first[base + left], first[base + right + 1], LANES):
                dx, dy, dz = _load(table[0], k) - px, _load(table[1], k) - py, _load(table[2], k) - pz
                d = dx * dx + dy * dy + dz * dz
                same = _load(table[3], k) * mx + _load(table[4], k) * my + _load(table[5], k) * mz
                better = both(d < best, same >= least)
                best, chosen = select(better, d, best), select(better, lanes + np.float32(k), chosen)
        one, other = lowest_of_halves(best)
        lowest = min(one, other)
        # Points beyond the square are farther than its nearest side.
        margin = (ring + inside) * side
        if (margin >= 0.0 and margin * margin >= lowest) or ring >= widest:
            break
        ring = min(max(ring + 1, int(math.sqrt(lowest) / side - inside) + 1), widest)
    one, other = lowest_of_halves(select(best > lowest, FAR, chosen))
    return min(one, other) if min(one, other) < FAR else groups.chosen[j]
