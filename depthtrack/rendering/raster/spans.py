"""Spans of tiles that a primitive may cover, tighter than its bounding box.

In a column of pixels a quadric is visible between the roots of D, and a segment of its axis between two rows. Both have
a closed form, evaluated for sixteen columns at once.
"""

import numpy as np

from depthtrack.rendering.raster import quadrics as q
from depthtrack.rendering.raster import tiles
from depthtrack.simd.functions import estimated_reciprocal_sqrt, highest_of_halves, lowest_of_halves
from depthtrack.simd.vectors import F32X16, kernel_part, loader, select, vmax, vmin
from depthtrack.types import Array32

_load = loader(F32X16)
_COLUMNS: Array32 = np.arange(16, dtype=np.float32)
_SLACK = np.float32(0.25)
"""Rows. The float32 roots are accurate to a hundredth, and the lanes decide exactly."""


@kernel_part
def find_spans(slot, is_segment, table, count, top, bottom, first, last):
    """Write the first and last tile that a primitive may cover, for `count` columns from LEFT.

    first, last: (count + 1,) tile rows; first[n] > last[n] if the primitive misses column LEFT + n. If `count` is odd,
    the extra element is written too.
    Needs D_VV < 0.
    """
    d, d_u, d_v = table[q.D * q.SLOTS + slot], table[q.D_U * q.SLOTS + slot], table[q.D_V * q.SLOTS + slot]
    d_uu, d_uv = table[q.D_UU * q.SLOTS + slot], table[q.D_UV * q.SLOTS + slot]
    four_a, half = np.float32(4.0) * table[q.D_VV * q.SLOTS + slot], table[q.HALF * q.SLOTS + slot]
    axis, axis_u = table[q.AXIS * q.SLOTS + slot], table[q.AXIS_U * q.SLOTS + slot]
    axis_near, axis_far = table[q.AXIS_NEAR * q.SLOTS + slot], table[q.AXIS_FAR * q.SLOTS + slot]
    per_row = table[q.ROWS_PER_AXIS * q.SLOTS + slot]
    height = np.float32((bottom - top + 1) * tiles.TILE_HEIGHT)
    for n in range(0, count, 2):
        x = _load(_COLUMNS, 0) + np.float32(n * tiles.TILE_WIDTH)
        b = x * d_uv + d_v
        discriminant = b * b - (x * (x * d_uu + d_u) + d) * four_a
        root = discriminant * estimated_reciprocal_sqrt(discriminant)
        low = select(discriminant > 0.0, (b - root) * half, height)
        high = select(discriminant > 0.0, (b + root) * half, np.float32(-2.0))
        if is_segment:
            e = x * axis_u + axis
            one, other = (axis_near - e) * per_row, (axis_far - e) * per_row
            low, high = vmax(low, vmin(one, other)), vmin(high, vmax(one, other))
        low_left, low_right = lowest_of_halves(vmin(vmax(low - _SLACK, 0.0), height))
        high_left, high_right = highest_of_halves(vmax(vmin(high + _SLACK, height - np.float32(1.0)), np.float32(-1.0)))
        first[n], last[n] = top + (int(low_left) >> 1), top + (int(high_left) >> 1)
        first[n + 1], last[n + 1] = top + (int(low_right) >> 1), top + (int(high_right) >> 1)
