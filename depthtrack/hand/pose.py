"""The 27-float pose vector and its 26-dimensional tangent space.

Layout: position of the palm's centre (3, metres, camera frame), orientation quaternion w x y z of the palm in
the camera frame (4), finger angles (20, radians): thumb, index, middle, ring, little, each abduction and then
three flexions from the palm outward. Every function broadcasts over leading axes: a batch is `(..., 27)`.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from depthtrack.geometry.rotations import normalised, quaternion_from_matrix, quaternion_product
from depthtrack.hand.compiled_tangent import retract_rows, tangent_rows
from depthtrack.types import Array

FINGERS = ("thumb", "index", "middle", "ring", "little")
POSE_SIZE = 27
TANGENT_SIZE = 26
POSITION = slice(0, 3)
ORIENTATION = slice(3, 7)
ANGLES = slice(7, 27)

_THUMB_JOINTS = ("cmc_abduction", "cmc_flexion", "mcp_flexion", "ip_flexion")
_FINGER_JOINTS = ("mcp_abduction", "mcp_flexion", "pip_flexion", "dip_flexion")
ANGLE_NAMES = tuple(
    f"{finger}_{joint}" for finger in FINGERS for joint in (_THUMB_JOINTS if finger == "thumb" else _FINGER_JOINTS)
)
POSE_NAMES = ("x", "y", "z", "qw", "qx", "qy", "qz", *ANGLE_NAMES)


def make_pose(position: ArrayLike, quaternion: ArrayLike, angles: ArrayLike) -> Array:
    """Return the pose (..., 27) of a position, an orientation and finger angles.

    position: (..., 3) metres, camera frame.
    quaternion: (..., 4), any length except zero.
    angles: (..., 20) radians.
    """
    parts = [np.asarray(part, dtype=np.float64) for part in (position, normalised(quaternion), angles)]
    batch = np.broadcast_shapes(*(part.shape[:-1] for part in parts))
    return np.concatenate([np.broadcast_to(part, (*batch, part.shape[-1])) for part in parts], axis=-1)


def retract(pose: ArrayLike, tangent: ArrayLike) -> Array:
    """Return the pose (..., 27) reached from `pose` by a step in its tangent space.

    pose: (..., 27).
    tangent: (..., 26) translation (3, metres), rotation vector about the palm's centre (3, radians), both in the camera
        frame, and change of the finger angles (20, radians).
    """
    return _of_rows(retract_rows, pose, tangent, POSE_SIZE)


def transformed(pose: ArrayLike, T_to_from: ArrayLike) -> Array:
    """Return the pose (..., 27) in another frame; the same bits under the identity.

    pose: (..., 27).
    T_to_from: (4, 4) rigid transform from the frame of the pose to the other frame, metres.
    """
    p, T = np.asarray(pose, dtype=np.float64), np.asarray(T_to_from, dtype=np.float64)
    position = p[..., POSITION] @ T[:3, :3].T + T[:3, 3]
    quaternion = quaternion_product(quaternion_from_matrix(T[:3, :3]), p[..., ORIENTATION])
    return np.concatenate([position, quaternion, p[..., ANGLES]], axis=-1)


def tangent_between(start: ArrayLike, end: ArrayLike) -> Array:
    """Return the step (..., 26) with `retract(start, step) == end`.

    start, end: poses (..., 27). The rotation angle of the step is at most pi.
    """
    return _of_rows(tangent_rows, start, end, TANGENT_SIZE)


def _of_rows(kernel: Callable[[Array, Array, Array], None], first: ArrayLike, second: ArrayLike, size: int) -> Array:
    """Return the output (..., size) of a kernel over the rows of two arrays, which broadcast."""
    a, b = np.asarray(first, dtype=np.float64), np.asarray(second, dtype=np.float64)
    batch = a.shape[:-1] if a.shape[:-1] == b.shape[:-1] else np.broadcast_shapes(a.shape[:-1], b.shape[:-1])
    out = np.empty((*batch, size))
    # Copies are contiguous and writable, so that one compiled kernel takes them all.
    a, b = (
        np.array(x if x.shape[:-1] == batch else np.broadcast_to(x, (*batch, x.shape[-1])), order="C") for x in (a, b)
    )
    kernel(a.reshape(-1, a.shape[-1]), b.reshape(-1, b.shape[-1]), out.reshape(-1, size))
    return out
