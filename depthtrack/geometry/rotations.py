"""Rotations as quaternions w x y z, rotation vectors and matrices.

The numpy functions broadcast over leading axes. The `compiled_` functions take and return scalars; numba kernels call
them.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from depthtrack.compilation import compiled
from depthtrack.types import Array

Quaternion = tuple[float, float, float, float]

_SMALL_ANGLE = 1e-9
"""Radians below which sin(angle / 2) / angle is 1/2 in double precision."""


def normalised(quaternion: ArrayLike) -> Array:
    """Return the unit quaternion (..., 4) with w >= 0, unique for a rotation."""
    q = np.asarray(quaternion, dtype=np.float64)
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return np.where(q[..., :1] < 0, -q, q)


def quaternion_product(a: ArrayLike, b: ArrayLike) -> Array:
    """Return the Hamilton product a b of quaternions (..., 4): the rotation b, then a."""
    a, b = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    scalar = a[..., :1] * b[..., :1] - np.sum(a[..., 1:] * b[..., 1:], axis=-1, keepdims=True)
    vector = a[..., :1] * b[..., 1:] + b[..., :1] * a[..., 1:] + np.cross(a[..., 1:], b[..., 1:])
    return np.concatenate([scalar, vector], axis=-1)


def quaternion_exp(rotation_vector: ArrayLike) -> Array:
    """Return the quaternion (..., 4) of a rotation vector (..., 3): axis times angle, radians."""
    v = np.asarray(rotation_vector, dtype=np.float64)
    half = np.linalg.norm(v, axis=-1, keepdims=True) / 2
    return np.concatenate([np.cos(half), v / 2 * np.sinc(half / np.pi)], axis=-1)


def quaternion_log(quaternion: ArrayLike) -> Array:
    """Return the rotation vector (..., 3), of angle at most pi, of a quaternion (..., 4)."""
    q = normalised(quaternion)
    sine = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(sine, q[..., :1])
    # angle / sine tends to 2 as the rotation vanishes.
    return q[..., 1:] * np.where(sine > 1e-12, angle / np.maximum(sine, 1e-12), 2.0)


def rotation_matrix(quaternion: ArrayLike) -> Array:
    """Return the rotation matrix (..., 3, 3) of a quaternion (..., 4) of any length except zero."""
    q = np.asarray(quaternion, dtype=np.float64)
    if q.ndim == 1:
        out = np.empty((3, 3))
        compiled_matrix(*q.tolist(), out)
        return out
    w, x, y, z = np.moveaxis(q / np.linalg.norm(q, axis=-1, keepdims=True), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def quaternion_from_matrix(rotation: ArrayLike) -> Array:
    """Return the unit quaternion (..., 4), w >= 0, of a rotation matrix (..., 3, 3)."""
    from scipy.spatial.transform import Rotation

    R = np.asarray(rotation, dtype=np.float64)
    xyzw = Rotation.from_matrix(R.reshape(-1, 3, 3)).as_quat()
    return normalised(xyzw[:, [3, 0, 1, 2]].reshape(*R.shape[:-2], 4))


def continuous(quaternions: Array) -> Array:
    """Return the same rotations as quaternions (T, ..., 4) that keep their sign from row to row."""
    turns = np.sum(quaternions[1:] * quaternions[:-1], axis=-1, keepdims=True) < 0
    signs = np.cumprod(np.where(turns, -1.0, 1.0), axis=0)
    return np.concatenate([quaternions[:1], quaternions[1:] * signs])


@compiled(nogil=True)
def compiled_normalised(w: float, x: float, y: float, z: float) -> Quaternion:
    """Return the unit quaternion with w >= 0."""
    scale = (1.0 if w >= 0 else -1.0) / math.sqrt(w * w + x * x + y * y + z * z)
    return w * scale, x * scale, y * scale, z * scale


@compiled(nogil=True)
def compiled_product(
    aw: float, ax: float, ay: float, az: float, bw: float, bx: float, by: float, bz: float
) -> Quaternion:
    """Return the Hamilton product a b: the rotation b, then a."""
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


@compiled(nogil=True)
def compiled_exp(x: float, y: float, z: float) -> Quaternion:
    """Return the quaternion of a rotation vector (rad)."""
    angle = math.sqrt(x * x + y * y + z * z)
    share = math.sin(angle / 2) / angle if angle > _SMALL_ANGLE else 0.5
    return math.cos(angle / 2), share * x, share * y, share * z


@compiled(nogil=True)
def compiled_log(w: float, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Return the rotation vector (rad), of angle at most pi, of a quaternion except zero."""
    w, x, y, z = compiled_normalised(w, x, y, z)
    sine = math.sqrt(x * x + y * y + z * z)
    share = 2 * math.atan2(sine, w) / sine if sine > 1e-12 else 2.0
    return share * x, share * y, share * z


@compiled(nogil=True)
def compiled_matrix(w: float, x: float, y: float, z: float, out: Array) -> None:
    """Write the rotation matrix of a quaternion of any length except zero to `out[:3, :3]`."""
    s = 2.0 / (w * w + x * x + y * y + z * z)
    out[0, 0], out[0, 1], out[0, 2] = 1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)
    out[1, 0], out[1, 1], out[1, 2] = s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x)
    out[2, 0], out[2, 1], out[2, 2] = s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)
