"""Forward kinematics from a pose to the quadrics of all primitives, a finger a lane."""

import math

import numpy as np

from depthtrack.rendering.raster import hand_constants as constants
from depthtrack.rendering.raster.quadrics import span, write_cones, write_general, write_spheres
from depthtrack.simd.functions import first, vfloor
from depthtrack.simd.vectors import F64X8, filler, kernel_part, loader, select
from depthtrack.types import Array, Array32

_load = loader(F64X8)
_fill = filler(F64X8)


@kernel_part
def set_up(pose: Array, hand: Array, camera: Array, scratch: Array, table: Array32) -> None:
    """Write the coefficient table of one pose: `HandModel.transforms` for all fingers at once.

    pose: (27,) metres, quaternion, radians, camera frame.
    hand: (ROWS * 8,) from `hand_constants.hand_constants`.
    camera: (8,) fx, fy, cx, cy, 1/fx, 1/fy, width, height, pixels.
    scratch: (32,) overwritten.
    table: (COEFFICIENT_ROWS * SLOTS,) float32, written.
    """
    R = _palm_rotation(pose[3], pose[4], pose[5], pose[6])
    x, y, z = _rotated(R, hand, 8 * 0, 8 * 3), _rotated(R, hand, 8 * 1, 8 * 3), _rotated(R, hand, 8 * 2, 8 * 3)
    p = _rotated(R, hand, 8 * constants.BASE_POSITION, 8 * 1)
    p = (p[0] + pose[0], p[1] + pose[1], p[2] + pose[2])
    for finger in range(5):
        for k in range(4):
            scratch[8 * k + finger] = pose[7 + 4 * finger + k]
    s, c = _sine_cosine(_load(scratch, 0) * _load(hand, 8 * constants.MIRROR))
    y, x = _turn(s, c, y, x)
    s1, c1 = _sine_cosine(_load(scratch, 8))
    s2, c2 = _sine_cosine(_load(scratch, 16))
    s3, c3 = _sine_cosine(_load(scratch, 24))
    # Spheres sit at the joints, cones between them. Each literal number of a phalanx would be compiled anew.
    n = np.int64(0)
    bounds = write_spheres(table, n, hand, camera, p)
    y, z = _turn(s1, c1, y, z)
    thumb = _load(hand, 8 * constants.IS_THUMB) > 0.5
    write_general(
        table,
        hand,
        camera,
        scratch,
        _with_thumb(thumb, R[0], R[3], R[6], x),
        _with_thumb(thumb, R[1], R[4], R[7], y),
        _with_thumb(thumb, R[2], R[5], R[8], z),
        _with_thumb(thumb, pose[0], pose[1], pose[2], p),
    )
    p, bounds = _phalanx(table, n, constants.LENGTH + n, hand, camera, bounds, p, y)
    y, z = _turn(s2, c2, y, z)
    p, bounds = _phalanx(table, n + 1, constants.LENGTH + 1, hand, camera, bounds, p, y)
    y, z = _turn(s3, c3, y, z)
    _phalanx(table, n + 2, constants.TIP_LENGTH + n, hand, camera, bounds, p, y)


@kernel_part
def _palm_rotation(qw, qx, qy, qz):
    """Return the rotation matrix of a quaternion of any length except zero, row by row."""
    n = 2.0 / (qw * qw + qx * qx + qy * qy + qz * qz)
    return (
        1 - n * (qy * qy + qz * qz), n * (qx * qy - qw * qz), n * (qx * qz + qw * qy),
        n * (qx * qy + qw * qz), 1 - n * (qx * qx + qz * qz), n * (qy * qz - qw * qx),
        n * (qx * qz - qw * qy), n * (qy * qz + qw * qx), 1 - n * (qx * qx + qy * qy),
    )  # fmt: skip


@kernel_part
def _rotated(R, hand, at, stride):
    """Return R times the constant vectors at the elements `at`, `at + stride`, `at + 2 stride`."""
    b0, b1, b2 = _load(hand, at), _load(hand, at + stride), _load(hand, at + 2 * stride)
    return (
        R[0] * b0 + R[1] * b1 + R[2] * b2,
        R[3] * b0 + R[4] * b1 + R[5] * b2,
        R[6] * b0 + R[7] * b1 + R[8] * b2,
    )


@kernel_part
def _turn(s, c, a, b):
    """Return the axes a and b turned in their plane, a towards b."""
    return (
        (c * a[0] + s * b[0], c * a[1] + s * b[1], c * a[2] + s * b[2]),
        (c * b[0] - s * a[0], c * b[1] - s * a[1], c * b[2] - s * a[2]),
    )


@kernel_part
def _sine_cosine(x):
    """Return sine and cosine to 1e-11, by their series about the nearest multiple of pi."""
    n = vfloor(x * (1 / math.pi) + 0.5)
    r = x - n * math.pi
    sign = 1.0 - 2.0 * (n - 2.0 * vfloor(n * 0.5))
    q = r * r
    s = q * (-1 / 1307674368000.0) + 1 / 6227020800.0
    s = q * s + (-1 / 39916800.0)
    s = q * s + 1 / 362880.0
    s = q * s + (-1 / 5040.0)
    s = q * s + 1 / 120.0
    s = q * s + (-1 / 6.0)
    s = q * s + 1.0
    c = q * (1 / 20922789888000.0) + (-1 / 87178291200.0)
    c = q * c + 1 / 479001600.0
    c = q * c + (-1 / 3628800.0)
    c = q * c + 1 / 40320.0
    c = q * c + (-1 / 720.0)
    c = q * c + 1 / 24.0
    c = q * c + (-0.5)
    c = q * c + 1.0
    return sign * s * r, sign * c


@kernel_part
def _with_thumb(mask, palm0, palm1, palm2, fingers):
    """Return the palm's vector in every lane except the ellipsoid's, which holds the thumb's."""
    return (
        select(mask, first(fingers[0]), _fill(palm0)),
        select(mask, first(fingers[1]), _fill(palm1)),
        select(mask, first(fingers[2]), _fill(palm2)),
    )


@kernel_part
def _phalanx(table, k, length_row, hand, camera, bounds, p, y):
    """Write cones k from joints `p` along `y` and the spheres at their far ends.

    Returns the far ends, metres, camera frame, and the pixel bounds of their spheres.
    """
    length = _load(hand, 8 * length_row)
    end = (p[0] + y[0] * length, p[1] + y[1] * length, p[2] + y[2] * length)
    end_bounds = write_spheres(table, k + 1, hand, camera, end)
    u_low, u_high = span(camera[6], bounds[0], bounds[1], p[2], end_bounds[0], end_bounds[1], end[2])
    v_low, v_high = span(camera[7], bounds[2], bounds[3], p[2], end_bounds[2], end_bounds[3], end[2])
    write_cones(table, k, hand, camera, (u_low, u_high, v_low, v_high), p, y)
    return end, end_bounds
