"""Where a depth map's visible surface is, on average."""

import numba
import numpy as np

from depthtrack.types import Array, Depth


@numba.njit(cache=True)
def visible_centroid(depth: Depth, intrinsics: tuple[float, float, float, float]) -> Array:
    """Mean point (3,), metres, camera frame, of a depth map (h, w) with 0 for no reading; NaN without any reading.

    `intrinsics` are fx, fy, cx, cy.
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
