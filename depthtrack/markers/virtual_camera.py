"""A camera for pictures of a capture, which has none of its own."""

import numpy as np

from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rotations import rotation_matrix
from depthtrack.hand.pose import ORIENTATION
from depthtrack.types import Array

_CAMERA = Camera(640, 480, 700.0, 700.0, 319.5, 239.5)
_MARGIN = 0.85
"""Share of the image, from its centre to its edge, that the points reach."""
_NEAREST = 0.25
"""Smallest distance of a point from the camera, metres."""
_COVERED = 99.5
"""Percentage of the points in the image: single wrong poses do not decide its size."""


def virtual_camera(poses: Array, points: Array) -> tuple[Camera, Array]:
    """Return a camera that shows the back of a hand, fingers upward, on its whole path.

    poses: (T, 27) capture frame; NaN where unknown.
    points: (..., 3) that the image shows, metres, capture frame; NaN where unknown.

    Returns:
        The camera and T_camera_capture (4, 4), metres. Without a pose the camera has the axes of the capture frame.
    """
    shown = points.reshape(-1, 3)
    shown = shown[np.isfinite(shown).all(axis=1)]
    T = np.eye(4)
    T[:3, :3] = _rotation(poses[np.isfinite(poses).all(axis=1)])
    if len(shown) == 0:
        T[2, 3] = 1.0
        return _CAMERA, T
    turned = shown @ T[:3, :3].T
    low, high = np.percentile(turned, [100 - _COVERED, _COVERED], axis=0)
    centred = turned - (low + high) / 2
    slopes = _MARGIN * np.array([_CAMERA.cx / _CAMERA.fx, _CAMERA.cy / _CAMERA.fy])
    nearest = np.max(np.abs(centred[:, :2]) / slopes, axis=1) - centred[:, 2]
    distance = max(float(np.percentile(nearest, _COVERED)), _NEAREST - float(centred[:, 2].min()))
    T[:3, 3] = [0, 0, distance] - (low + high) / 2
    return _CAMERA, T


def _rotation(poses: Array) -> Array:
    """Return the rotation (3, 3) to a camera that faces the back of the mean palm."""
    if len(poses) == 0:
        return np.eye(3)
    # Chordal mean: the rotation nearest to the mean of the matrices.
    U, _, Vt = np.linalg.svd(rotation_matrix(poses[:, ORIENTATION]).mean(axis=0))
    palm = U @ np.diag([1, 1, np.linalg.det(U) * np.linalg.det(Vt)]) @ Vt
    return np.stack([-palm[:, 0], -palm[:, 1], palm[:, 2]])
