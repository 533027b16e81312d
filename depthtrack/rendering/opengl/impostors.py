"""Impostors of poses: a rectangle a primitive and the map of its pixels to the unit frame.

A point at inverse depth w on the ray of a pixel is (dx, dy, 1, w) up to scale. The inverse of T_camera_unit maps it to
the primitive's unit frame. Pixels (x, y) are counted from an anchor inside the rectangle, and w from that of the
primitive's middle. The map then has columns of order one, so the fragment shader solves its quadratic in float32
without cancellation. All steps before the shader use float64.
"""

import math
from typing import NamedTuple, Self

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.hand.compiled_kinematics import BODY_COUNT, BodyPoses, Chain, forward_kinematics
from depthtrack.hand.primitives import CYLINDER, Primitives
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.rendered_surface import NEAR
from depthtrack.types import Array, Array32, Index

VECTORS = 6
"""Number of 4-vectors of an impostor.

0: its rectangle in the atlas: left, top, right, bottom edges, pixels.
1 to 4: the columns of its map that multiply x, y, 1 and w.
5: w of its middle, 1 for a ball or 0 for a cylinder, and the anchor in the atlas (2), pixels.
"""


class HandTable(NamedTuple):
    """The pose-independent constants of a hand for the kernels.

    chain: see `Chain`.
    kinds, bodies, T_body_unit: (N,), (N,) and (N, 4, 4), metres; see `Primitives`.
    T_unit_body: (N, 4, 4) inverses of T_body_unit.
    """

    chain: Chain
    kinds: Index
    bodies: Index
    T_body_unit: Array
    T_unit_body: Array

    @classmethod
    def of(cls, shape: HandShape) -> Self:
        """Return the constants of a hand."""
        primitives = Primitives.of(shape)
        return cls(
            Chain.of(shape),
            primitives.kinds,
            primitives.bodies,
            primitives.T_body_unit,
            np.linalg.inv(primitives.T_body_unit).astype(np.float64),
        )


@compiled(nogil=True)
def place_impostors(
    poses: Array,
    hand: HandTable,
    intrinsics: tuple[float, float, float, float],
    tile: tuple[int, int],
    columns: int,
    instances: Array32,
    regions: Index,
) -> int:
    """Write the impostors of all poses, tile by tile; return their number.

    poses: (B, 27) metres, quaternion, radians, camera frame.
    intrinsics: fx, fy, cx, cy, pixels.
    tile: (height, width), pixels; `columns` tiles make a row of the atlas.
    instances: (>= 37 B, 6, 4) written as `VECTORS` describes; invisible primitives are left out.
    regions: (B, 4) written: the pixels of each tile that may be drawn, in the order of `geometry.rectangle.Rect`.
    """
    bodies = BodyPoses(np.empty((BODY_COUNT, 3, 4)), np.empty((20, 3)), np.empty((20, 3)))
    T, M, map_ = np.empty((4, 4)), np.empty((4, 4)), np.empty((4, 4))
    region = np.empty(4, np.int64)
    height, width = tile
    fx, fy, cx, cy = intrinsics
    count = 0
    for n in range(poses.shape[0]):
        forward_kinematics(hand.chain, poses[n], bodies)
        left, top = n % columns * width, n // columns * height
        regions[n, 0], regions[n, 1], regions[n, 2], regions[n, 3] = width, height, 0, 0
        for k in range(hand.kinds.shape[0]):
            body, is_cylinder = hand.bodies[k], hand.kinds[k] == CYLINDER
            _compose(bodies.T[body], hand.T_body_unit[k], T)
            middle = _bounds(T, is_cylinder, intrinsics, tile, region)
            u0, v0, u1, v1 = region
            if middle <= 0.0 or u1 <= u0 or v1 <= v0:
                continue
            regions[n, 0], regions[n, 1] = min(regions[n, 0], u0), min(regions[n, 1], v0)
            regions[n, 2], regions[n, 3] = max(regions[n, 2], u1), max(regions[n, 3], v1)
            _uncompose(hand.T_unit_body[k], bodies.T[body], M)
            anchor_u, anchor_v, w = (u0 + u1) // 2, (v0 + v1) // 2, 1.0 / middle
            dx, dy = (anchor_u - cx) / fx, (anchor_v - cy) / fy
            for i in range(4):
                map_[0, i] = M[i, 0] / fx
                map_[1, i] = M[i, 1] / fy
                map_[2, i] = M[i, 0] * dx + M[i, 1] * dy + M[i, 2] + M[i, 3] * w
                map_[3, i] = M[i, 3]
            out = instances[count]
            out[0, 0], out[0, 1], out[0, 2], out[0, 3] = left + u0, top + v0, left + u1, top + v1
            out[1:5] = map_
            out[5, 0], out[5, 1] = w, 0.0 if is_cylinder else 1.0
            out[5, 2], out[5, 3] = left + anchor_u + 0.5, top + anchor_v + 0.5
            count += 1
    return count


@compiled()
def _compose(B: Array, T_body_unit: Array, T: Array) -> None:
    """Write T_camera_unit = T_camera_body T_body_unit to `T`; `B` (3, 4) is T_camera_body."""
    for j in range(4):
        x, y, z, w = T_body_unit[0, j], T_body_unit[1, j], T_body_unit[2, j], T_body_unit[3, j]
        for i in range(3):
            T[i, j] = B[i, 0] * x + B[i, 1] * y + B[i, 2] * z + B[i, 3] * w
        T[3, j] = w


@compiled()
def _uncompose(T_unit_body: Array, B: Array, M: Array) -> None:
    """Write T_unit_camera = T_unit_body T_body_camera to `M` (4, 4).

    B = [R t] (3, 4) is T_camera_body; the inverse of [R t; 0 1] is [R' -R't; 0 1].
    """
    for i in range(4):
        x, y, z = T_unit_body[i, 0], T_unit_body[i, 1], T_unit_body[i, 2]
        M[i, 3] = T_unit_body[i, 3]
        for j in range(3):
            M[i, j] = x * B[j, 0] + y * B[j, 1] + z * B[j, 2]
            M[i, 3] -= M[i, j] * B[j, 3]


@compiled()
def _bounds(
    T: Array, is_cylinder: bool, intrinsics: tuple[float, float, float, float], tile: tuple[int, int], region: Index
) -> float:
    """Write the pixels of the tile that a primitive may cover to `region`, ordered like `Rect`.

    T: (4, 4) T_camera_unit. Tangent planes through the optical centre bound the image of a ball. Those of the two end
    discs bound a cone. Returns the middle depth, metres, of the part beyond NEAR, or 0 if there is none.
    """
    fx, fy, cx, cy = intrinsics
    height, width = tile
    x_low, x_high, y_low, y_high = math.inf, -math.inf, math.inf, -math.inf
    z_low, z_high = math.inf, -math.inf
    for end in range(2 if is_cylinder else 1):
        # The centre and the sums of products of the axes bound the outline of a ball or disc.
        w = T[3, 3] + end * T[3, 2]
        px, py, pz = (T[0, 3] + end * T[0, 2]) / w, (T[1, 3] + end * T[1, 2]) / w, (T[2, 3] + end * T[2, 2]) / w
        xx, yy, xz, yz, zz = 0.0, 0.0, 0.0, 0.0, 0.0
        for j in range(2 if is_cylinder else 3):
            x, y, z = T[0, j] / w, T[1, j] / w, T[2, j] / w
            xx, yy, xz, yz, zz = xx + x * x, yy + y * y, xz + x * z, yz + y * z, zz + z * z
        z_low, z_high = min(z_low, pz - math.sqrt(zz)), max(z_high, pz + math.sqrt(zz))
        a = pz * pz - zz
        if a > 0.0:
            # The tangent planes x - s z = 0 solve a s^2 - 2 b s + c = 0; likewise for y.
            b = px * pz - xz
            root = math.sqrt(max(b * b - a * (px * px - xx), 0.0))
            x_low, x_high = min(x_low, (b - root) / a), max(x_high, (b + root) / a)
            b = py * pz - yz
            root = math.sqrt(max(b * b - a * (py * py - yy), 0.0))
            y_low, y_high = min(y_low, (b - root) / a), max(y_high, (b + root) / a)
    if z_high < NEAR:
        return 0.0
    if z_low < 0.01 * NEAR:  # reaches the plane z = 0: its image is unbounded
        region[0], region[1], region[2], region[3] = 0, 0, width, height
    else:
        slack = 1e-6
        region[0] = int(min(max(math.ceil(x_low * fx + cx - slack), 0.0), width))
        region[1] = int(min(max(math.ceil(y_low * fy + cy - slack), 0.0), height))
        region[2] = int(max(min(math.floor(x_high * fx + cx + slack) + 1.0, width), 0.0))
        region[3] = int(max(min(math.floor(y_high * fy + cy + slack) + 1.0, height), 0.0))
    return (max(z_low, NEAR) + z_high) / 2
