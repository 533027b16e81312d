"""Flying pixels: readings between a surface and what is behind it, where a pixel saw both.

Time-of-flight sensors mix what a pixel sees into one depth (Foix, Alenya and Torras, "Lock-in time-of-flight (ToF)
cameras: a survey", IEEE Sensors Journal 2011): fingers get rims, and wisps reach from their tips into nothing.
"""

import numba
import numpy as np

from depthtrack.types import Depth, Mask

STEEPEST = 6.0
"""Tangent of the angle to the image plane beyond which no surface returns enough light: 80 degrees."""


def flying_pixels(depth: Depth, focal: float) -> Mask:
    """Which readings of a depth image (h, w; metres) of `focal` pixels hang in the air: along a row or a column, behind
    a neighbour by more than a surface of STEEPEST slope would be, and not within that of the one on the other side."""
    out = np.zeros(depth.shape, dtype=np.bool_)
    mark_flying(np.ascontiguousarray(depth), STEEPEST / focal, out)
    return out


@numba.njit(cache=True, nogil=True)
def mark_flying(depth: Depth, slope: float, out: Mask) -> None:
    """True into `out` (h, w) where a reading is farther than `slope` times its depth from all readings beside it in its
    row, or in its column, and behind one of them."""
    height, width = depth.shape
    for v in range(height):
        for u in range(width):
            z = np.float64(depth[v, u])
            if z <= 0.0:
                continue
            most = slope * z
            for dv, du in ((0, 1), (1, 0)):
                held, behind = False, False
                for side in (-1, 1):
                    i, j = v + side * dv, u + side * du
                    if 0 <= i < height and 0 <= j < width and depth[i, j] > 0.0:
                        step = z - depth[i, j]
                        held |= abs(step) <= most
                        behind |= step > most
                if behind and not held:
                    out[v, u] = True
