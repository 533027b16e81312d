"""The 27-float pose vector and the 26-dimensional tangent space that solvers step in.

Layout: position of the palm's centre (3, metres, camera frame), orientation quaternion w x y z of the palm in
the camera frame (4), finger angles (20, radians): thumb, index, middle, ring, little, each abduction and then
three flexions from the palm outward. Every function broadcasts over leading axes: a batch is `(..., 27)`.
"""

import numpy as np
from numpy.typing import ArrayLike

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
    """Pose (..., 27) from position (..., 3), quaternion (..., 4, any length but zero) and angles (..., 20)."""
    parts = [np.asarray(part, dtype=np.float64) for part in (position, normalised(quaternion), angles)]
    batch = np.broadcast_shapes(*(part.shape[:-1] for part in parts))
    return np.concatenate([np.broadcast_to(part, (*batch, part.shape[-1])) for part in parts], axis=-1)


def normalised(quaternion: ArrayLike) -> Array:
    """Unit quaternion (..., 4), w >= 0 so that one rotation has one representation."""
    q = np.asarray(quaternion, dtype=np.float64)
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return np.where(q[..., :1] < 0, -q, q)


def quaternion_product(a: ArrayLike, b: ArrayLike) -> Array:
    """Hamilton product a b of quaternions (..., 4): first rotate by b, then by a."""
    a, b = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    scalar = a[..., :1] * b[..., :1] - np.sum(a[..., 1:] * b[..., 1:], axis=-1, keepdims=True)
    vector = a[..., :1] * b[..., 1:] + b[..., :1] * a[..., 1:] + np.cross(a[..., 1:], b[..., 1:])
    return np.concatenate([scalar, vector], axis=-1)


def quaternion_exp(rotation_vector: ArrayLike) -> Array:
    """Quaternion (..., 4) of a rotation vector (..., 3): axis times angle, radians."""
    v = np.asarray(rotation_vector, dtype=np.float64)
    half = np.linalg.norm(v, axis=-1, keepdims=True) / 2
    return np.concatenate([np.cos(half), v / 2 * np.sinc(half / np.pi)], axis=-1)


def quaternion_log(quaternion: ArrayLike) -> Array:
    """Rotation vector (..., 3), of angle at most pi, of a unit quaternion (..., 4)."""
    q = normalised(quaternion)
    sine = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(sine, q[..., :1])
    # angle / sine tends to 2 as the rotation vanishes.
    return q[..., 1:] * np.where(sine > 1e-12, angle / np.maximum(sine, 1e-12), 2.0)


def rotation_matrix(quaternion: ArrayLike) -> Array:
    """Rotation matrix (..., 3, 3) of a quaternion (..., 4), normalised on the way."""
    q = np.asarray(quaternion, dtype=np.float64)
    w, x, y, z = np.moveaxis(q / np.linalg.norm(q, axis=-1, keepdims=True), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def quaternion_from_matrix(rotation: ArrayLike) -> Array:
    """Unit quaternion (..., 4) of a rotation matrix (..., 3, 3)."""
    from scipy.spatial.transform import Rotation

    R = np.asarray(rotation, dtype=np.float64)
    xyzw = Rotation.from_matrix(R.reshape(-1, 3, 3)).as_quat()
    return normalised(xyzw[:, [3, 0, 1, 2]].reshape(*R.shape[:-2], 4))


def retract(pose: ArrayLike, tangent: ArrayLike) -> Array:
    """Pose (..., 27) reached from `pose` by a step (..., 26) in its tangent space.

    The step holds the translation (3, m), the rotation vector applied about the palm's centre in the camera
    frame (3, rad), and the change of the angles (20, rad).
    """
    p, t = np.asarray(pose, dtype=np.float64), np.asarray(tangent, dtype=np.float64)
    quaternion = quaternion_product(quaternion_exp(t[..., 3:6]), p[..., ORIENTATION])
    return make_pose(p[..., POSITION] + t[..., :3], quaternion, p[..., ANGLES] + t[..., 6:])


def tangent_between(start: ArrayLike, end: ArrayLike) -> Array:
    """The step (..., 26) with `retract(start, step) == end`, the rotation taken the short way round."""
    a, b = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    conjugate = a[..., ORIENTATION] * np.array([1.0, -1.0, -1.0, -1.0])
    rotation = quaternion_log(quaternion_product(b[..., ORIENTATION], conjugate))
    return np.concatenate([b[..., POSITION] - a[..., POSITION], rotation, b[..., ANGLES] - a[..., ANGLES]], axis=-1)
