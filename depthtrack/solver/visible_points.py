"""Visible points of a posed surface, sorted into cells of the image.

A point is visible if it faces the camera and no nearer point of its cell hides it.
"""

from typing import NamedTuple

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.simd.functions import vfloor
from depthtrack.simd.vectors import F32X16, F64X8, both, kernel_part, loader, select, store
from depthtrack.solver.surface_points import LANES as BLOCK
from depthtrack.types import Array, Array32, Index

LANES = F32X16.lanes
"""Points that a search compares at a time, and columns of padding."""
FAR = np.float32(1e6)
"""Metres: coordinate of padding, beyond any point."""
_MOST_CELLS = 512
"""Most cells of a row or column, which bound the memory."""
_load = loader(F64X8)


class Visible(NamedTuple):
    """Visible points sorted by cell.

    first: (C + 1,) cell c contains the rows from first[c] up to first[c + 1].
    vertex: (S,) columns of the posed points.
    points: (S, 6) coordinates, metres, camera frame, and unit normals.
    table: (6, S + LANES) the same in single precision, relative to `origin`; the last LANES columns are padding.
    origin: (3,) metres, camera frame.
    """

    first: Index
    vertex: Index
    points: Array
    table: Array32
    origin: Array


class Cells(NamedTuple):
    """Square cells of the image plane z = 1.

    u, v: corner of the first cell.
    size: side of a cell.
    rows, columns: numbers of cells.
    """

    u: float
    v: float
    size: float
    rows: int
    columns: int


def cells_over(points: Array, size: float, margin: float) -> Cells:
    """Return the cells that cover the image of points and a margin around it.

    points: (N, 3) metres, camera frame.
    size, margin: side of a cell and width of the margin, metres at the mean depth of the points. Cells are larger where
        a side would need more than _MOST_CELLS.
    """
    return Cells(*_cells_over(points, size, margin))


@compiled(nogil=True)
def _cells_over(points: Array, size: float, margin: float) -> tuple[float, float, float, int, int]:
    if points.shape[0] == 0:
        return 0.0, 0.0, 1.0, 1, 1
    low_u = low_v = 1e9
    high_u = high_v = -1e9
    depth = 0.0
    for i in range(points.shape[0]):
        z = points[i, 2]
        u, v = points[i, 0] / z, points[i, 1] / z
        low_u, high_u, low_v, high_v = min(low_u, u), max(high_u, u), min(low_v, v), max(high_v, v)
        depth += z
    depth /= points.shape[0]
    around = margin / depth
    width, height = high_u - low_u + 2 * around, high_v - low_v + 2 * around
    side = max(size / depth, max(width, height) / (_MOST_CELLS - 1))
    columns = min(int(width / side) + 1, _MOST_CELLS)
    rows = min(int(height / side) + 1, _MOST_CELLS)
    return low_u - around, low_v - around, side, rows, columns


@compiled(nogil=True)
def sort_visible(posed: Array, cells: Cells, origin: Array, tolerance: float) -> Visible:
    """Return the visible points, sorted by cell.

    posed: (6, P) points, metres, camera frame, and unit normals; P is a multiple of eight.
    tolerance: metres behind the nearest point of its cell from which on a point is hidden.
    """
    depth, cell = posed[2], np.empty(posed.shape[1])
    facing, count = np.empty(posed.shape[1] + 1, np.int64), 0
    _find_cells(posed, cells, cell)
    for v in range(cell.shape[0]):
        facing[count] = v
        count += cell[v] >= 0.0
    nearest, first = np.full(cells.rows * cells.columns, 1e9), np.zeros(cells.rows * cells.columns + 1, np.int64)
    for i in range(count):
        c = int(cell[facing[i]])
        nearest[c] = min(nearest[c], depth[facing[i]])
    total = 0
    for i in range(count):
        v = facing[i]
        c = int(cell[v])
        seen = depth[v] <= nearest[c] + tolerance
        facing[total] = v
        total += seen
        first[c + 1] += seen
    for c in range(1, first.shape[0]):
        first[c] += first[c - 1]
    table = np.empty((6, total + LANES), np.float32)
    visible, slots = Visible(first, np.empty(total, np.int64), np.empty((total, 6)), table, origin), first[:-1].copy()
    for i in range(total):
        v = facing[i]
        c = int(cell[v])
        k = slots[c]
        slots[c] += 1
        visible.vertex[k] = v
        for j in range(6):
            visible.points[k, j] = posed[j, v]
        for j in range(3):
            table[j, k], table[3 + j, k] = posed[j, v] - origin[j], posed[3 + j, v]
    for j in range(6):
        table[j, total:] = FAR
    return visible


@kernel_part
def _find_cells(posed: Array, cells: Cells, out: Array) -> None:
    """Write the cell of each point to `out` (P,).

    It is -1 if the point faces away or lies in no cell.
    """
    scale = 1.0 / cells.size
    for v in range(0, posed.shape[1], BLOCK):
        x, y, z = _load(posed[0], v), _load(posed[1], v), _load(posed[2], v)
        facing = _load(posed[3], v) * x + _load(posed[4], v) * y + _load(posed[5], v) * z
        inverse = 1.0 / z
        column, row = vfloor((x * inverse - cells.u) * scale), vfloor((y * inverse - cells.v) * scale)
        ahead = both(z > 1e-3, facing < 0.0)
        inside = both(both(column >= 0.0, column < cells.columns), both(row >= 0.0, row < cells.rows))
        store(out, v, select(both(ahead, inside), row * cells.columns + column, -1.0))
