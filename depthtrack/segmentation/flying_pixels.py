"""Flying pixels: readings between a surface and its background.

Time-of-flight sensors mix both distances at a pixel that receives light from both. Fingers get rims, and streaks extend
from their tips.

Source: Foix, Alenya and Torras, "Lock-in time-of-flight (ToF) cameras: a survey", IEEE Sensors Journal 2011.
"""

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.segmentation.options import FlyingPixelOptions
from depthtrack.types import Depth, Mask


def flying_pixels(depth: Depth, focal: float, options: FlyingPixelOptions | None = None) -> Mask:
    """Return the mask (h, w) of flying pixels.

    A flying pixel is behind a neighbour in its row or column by more than the steepest surface. No neighbour in that
    row or column is within the steepest surface.

    depth: (h, w), metres.
    focal: focal length, pixels.
    """
    options = options or FlyingPixelOptions()
    out = np.zeros(depth.shape, dtype=np.bool_)
    mark_flying_pixels(np.ascontiguousarray(depth), options.steepest / focal, out)
    return out


@compiled(nogil=True)
def mark_flying_pixels(depth: Depth, slope: float, out: Mask) -> None:
    """Set the flying pixels of a depth image in `out`.

    depth: (h, w), metres.
    slope: largest depth step to the next pixel on a surface, as a share of the depth.
    out: (h, w).
    """
    height, width = depth.shape
    for v in range(height):
        for u in range(width):
            z = np.float64(depth[v, u])
            if z <= 0.0:
                continue
            most = slope * z
            for dv, du in ((0, 1), (1, 0)):
                supported, behind = False, False
                for side in (-1, 1):
                    i, j = v + side * dv, u + side * du
                    if 0 <= i < height and 0 <= j < width and depth[i, j] > 0.0:
                        step = z - depth[i, j]
                        supported |= abs(step) <= most
                        behind |= step > most
                if behind and not supported:
                    out[v, u] = True
