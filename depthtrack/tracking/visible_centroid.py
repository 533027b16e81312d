"""The centroid of the surface that a depth map shows."""

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.types import Array, Depth


@compiled()
def visible_centroid(depth: Depth, intrinsics: tuple[float, float, float, float]) -> Array:
    """Return the mean point (3,), m, camera frame, of a depth map; NaN without any reading.

    depth: (h, w) metres, 0 for no reading.
    intrinsics: fx, fy, cx, cy in pixels.
    """
    fx, fy, cx, cy = intrinsics
    count, x, y, z = 0, 0.0, 0.0, 0.0
    for v in range(depth.shape[0]):
        for u in range(depth.shape[1]):
            d = np.float64(depth[v, u])
            if d > 0.0:
                count += 1
                x, y, z = x + (u - cx) / fx * d, y + (v - cy) / fy * d, z + d
    sums = np.array([x, y, z])
    return sums / count if count > 0 else np.full(3, np.nan)
