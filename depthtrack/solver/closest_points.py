"""Search for the visible point closest to each observed point, sixteen at a time."""

import math

import numpy as np

from depthtrack.simd.functions import lowest_of_halves
from depthtrack.simd.vectors import F32X16, both, filler, kernel_part, loader, select
from depthtrack.types import Array32

LANES = F32X16.lanes
FAR = np.float32(1e6)
"""Metres: coordinate of padding, beyond any point."""
_LANE: Array32 = np.arange(LANES, dtype=np.float32)

_load = loader(F32X16)
_fill = filler(F32X16)


@kernel_part
def closest_vertices(cloud, visible, cells, max_distance, min_normal_cosine, closest):
    """Write the row of the visible point closest to each observed point to `closest`.

    cloud: N observed points and normals, camera frame.
    visible: visible points sorted by cell, see `surfaces.points.Visible`.
    max_distance: largest distance, m.
    min_normal_cosine: smallest cosine between the normals.
    closest: (N,) rows of `visible`, -1 for none.

    Cells are searched in growing squares around the cell of the point, until no point beyond can be closer or no cell
    is left. The cells of a row are contiguous in memory. A load of sixteen points may include further cells, whose
    points are valid too.
    """
    points, normals, origin, first = cloud.points, cloud.normals, visible.origin, visible.first
    sx, sy, sz, nx, ny, nz = (
        visible.table[0],
        visible.table[1],
        visible.table[2],
        visible.table[3],
        visible.table[4],
        visible.table[5],
    )
    # Rays through image points that are d apart pass a point at depth z no closer than d z / |(u, v, 1)|.
    u = max(abs(cells.u), abs(cells.u + cells.columns * cells.size))
    v = max(abs(cells.v), abs(cells.v + cells.rows * cells.size))
    slant = 1.0 / math.sqrt(1.0 + u * u + v * v)
    lanes, limit, least = _load(_LANE, 0), np.float32(max_distance * max_distance), np.float32(min_normal_cosine)
    for i in range(points.shape[0]):
        z = points[i, 2]
        # The position of the point among the cells, and the side of a cell in metres there.
        p, q = (points[i, 0] / z - cells.u) / cells.size, (points[i, 1] / z - cells.v) / cells.size
        column, row, side = int(p), int(q), cells.size * z * slant
        inside = min(p - column, column + 1 - p, q - row, row + 1 - q)
        px, py, pz = (
            np.float32(points[i, 0] - origin[0]),
            np.float32(points[i, 1] - origin[1]),
            np.float32(z - origin[2]),
        )
        mx, my, mz = np.float32(normals[i, 0]), np.float32(normals[i, 1]), np.float32(normals[i, 2])
        best, chosen, lowest, ring = _fill(limit), _fill(FAR), limit, 1
        while True:
            left, right = max(column - ring, 0), min(column + ring, cells.columns - 1)
            for r in range(max(row - ring, 0), min(row + ring, cells.rows - 1) + 1):
                base = r * cells.columns
                whole = ring == 1 or r == row - ring or r == row + ring
                # Only both ends of the middle rows of a square are new.
                for end in range(1 if whole else 2):
                    low = left if whole or end == 0 else right
                    high = right if whole or end == 1 else left
                    for k in range(first[base + low], first[base + high + 1], LANES):
                        dx, dy, dz = _load(sx, k) - px, _load(sy, k) - py, _load(sz, k) - pz
                        d = dx * dx + dy * dy + dz * dz
                        same = _load(nx, k) * mx + _load(ny, k) * my + _load(nz, k) * mz
                        better = both(d < best, same >= least)
                        best, chosen = select(better, d, best), select(better, lanes + np.float32(k), chosen)
            one, other = lowest_of_halves(best)
            lowest = min(one, other)
            # The next square begins where the nearest side of this one ends.
            margin = (ring + inside) * side
            if margin * margin >= lowest or ring >= max(cells.columns, cells.rows):
                break
            ring += 1
        one, other = lowest_of_halves(select(best > lowest, FAR, chosen))
        closest[i] = int(min(one, other)) if min(one, other) < FAR else -1
