"""Visibility of points inside a hand in a depth map."""

import numpy as np

from depthtrack.geometry.camera import Camera
from depthtrack.types import Array, Depth, Mask

FLESH = 0.02
"""Metres: largest depth of a joint or bone below the skin that shows it, with a margin."""


def points_in_view(points: Array, depth: Depth, camera: Camera, behind: float | Array = FLESH) -> Mask:
    """Return which points (..., 3) of a hand are in the image with nothing before them.

    points: metres, camera frame; a NaN counts as hidden.
    depth: (h, w) of the scene, of the posed hand or of an object, metres; 0 for none.
    behind: largest depth behind it of a visible point, metres; one for all, or one of each (...).
    """
    pixels = camera.project(points)
    inside = np.asarray(np.isfinite(pixels).all(axis=-1), dtype=np.bool_)
    u, v = np.moveaxis(np.rint(np.where(inside[..., None], pixels, -1)).astype(np.int64), -1, 0)
    inside &= (u >= 0) & (v >= 0) & (u < camera.width) & (v < camera.height)
    front = np.zeros(inside.shape)
    front[inside] = depth[v[inside], u[inside]]
    return np.asarray(inside & ((front == 0) | (points[..., 2] - front < behind)), dtype=np.bool_)
