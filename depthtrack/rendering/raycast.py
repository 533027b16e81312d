"""A plain float64 ray caster of transformed unit spheres and cylinders.

Every pixel's ray is transformed to the unit frame of each primitive and intersected with
ux^2 + uy^2 (+ uz^2) = uw^2. Homogeneous coordinates cover cones, the projective images of the cylinder.
"""

import math

import numpy as np
from numpy.typing import NDArray

from depthtrack.compilation import compiled
from depthtrack.geometry.camera import Camera
from depthtrack.hand.primitives import CYLINDER
from depthtrack.rendering.rendered_surface import NEAR, RenderedSurface
from depthtrack.types import Array, Index

_OF_SPHERE: Array = np.array([(x, y, z, 1.0) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
_OF_CYLINDER: Array = np.array([(x, y, z, 1.0) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (0.0, 1.0)])
"""(8, 4) corners of the bounding boxes of the primitives in their unit frames."""


def raycast(
    camera: Camera,
    kinds: Index,
    T_camera_unit: Array,
    labels: Index,
    onto: RenderedSurface | None = None,
) -> RenderedSurface:
    """Render N unit primitives; return the nearest hit at every pixel centre.

    kinds: (N,) SPHERE or CYLINDER.
    T_camera_unit: (N, 4, 4) metres, from a primitive's unit frame to the camera frame.
    labels: (N,) written at the pixels of each primitive.
    onto: a surface to draw over in place; a new one if None.

    Only faces visible from outside and beyond NEAR are drawn, so a primitive around the optical centre is invisible.
    Cylinders are open, since the hand closes every end with a sphere or ellipsoid.
    """
    surface = RenderedSurface.empty(camera) if onto is None else onto
    inverses: Array = np.linalg.inv(np.asarray(T_camera_unit, dtype=np.float64)).astype(np.float64, copy=False)
    regions = _bounds(camera, np.asarray(kinds), np.asarray(T_camera_unit, dtype=np.float64).reshape(-1, 4, 4))
    _cast(
        np.asarray(kinds, dtype=np.int64),
        inverses,
        np.asarray(labels, dtype=np.int16),
        regions,
        (camera.fx, camera.fy, camera.cx, camera.cy),
        surface.depth,
        surface.label,
        surface.normal,
    )
    return surface


def _bounds(camera: Camera, kinds: Index, T: Array) -> Index:
    """Return the pixels (N, 4), as in `Rect`, that the bounding boxes of primitives cover.

    T: (N, 4, 4) T_camera_unit.
    """
    corners = np.where((kinds == CYLINDER)[:, None, None], _OF_CYLINDER, _OF_SPHERE) @ np.swapaxes(T, 1, 2)
    points = corners[..., :3] / corners[..., 3:]
    z = points[..., 2]
    # Beyond an image's size, rounding to whole pixels does not matter.
    pixels = np.clip(np.nan_to_num(camera.project(points)), -1e6, 1e6)
    low, high = np.floor(pixels.min(axis=1)), np.ceil(pixels.max(axis=1)) + 1
    size = np.array([camera.width, camera.height], dtype=np.float64)
    regions = np.concatenate([np.clip(low, 0, size), np.clip(high, 0, size)], axis=1).astype(np.int64)
    regions[z.min(axis=1) < NEAR] = camera.rect  # extends behind the camera: its image is unbounded
    regions[z.max(axis=1) < NEAR] = 0
    return regions


@compiled(nogil=True)
def _cast(
    kinds: Index,
    inverses: Array,
    labels: NDArray[np.int16],
    regions: Index,
    intrinsics: tuple[float, float, float, float],
    depth: Array,
    label: NDArray[np.int16],
    normal: Array,
) -> None:
    fx, fy, cx, cy = intrinsics
    near = NEAR
    for n in range(kinds.shape[0]):
        M = inverses[n]
        # Spheres add uz^2 to the quadric; for cylinders uz only bounds the segment.
        zz = 0.0 if kinds[n] == CYLINDER else 1.0
        for v in range(regions[n, 1], regions[n, 3]):
            for u in range(regions[n, 0], regions[n, 2]):
                dx, dy = (u - cx) / fx, (v - cy) / fy
                # A point of the ray is (t dx, t dy, t): in the unit frame, t a + b.
                ax = M[0, 0] * dx + M[0, 1] * dy + M[0, 2]
                ay = M[1, 0] * dx + M[1, 1] * dy + M[1, 2]
                az = M[2, 0] * dx + M[2, 1] * dy + M[2, 2]
                aw = M[3, 0] * dx + M[3, 1] * dy + M[3, 2]
                bx, by, bz, bw = M[0, 3], M[1, 3], M[2, 3], M[3, 3]
                A = ax * ax + ay * ay + zz * az * az - aw * aw
                B = ax * bx + ay * by + zz * az * bz - aw * bw
                C = bx * bx + by * by + zz * bz * bz - bw * bw
                D = B * B - A * C
                if D < 0.0:
                    continue
                root = math.sqrt(D)
                # Stable roots of A t^2 + 2 B t + C = 0.
                q = -(B + root) if B >= 0.0 else -(B - root)
                for k in range(2):
                    if k == 0:
                        if A == 0.0:
                            continue
                        t = q / A
                    else:
                        if q == 0.0:
                            continue
                        t = C / q
                    if not t >= near or (depth[v, u] > 0.0 and t >= depth[v, u]):
                        continue
                    ux, uy, uz, uw = t * ax + bx, t * ay + by, t * az + bz, t * aw + bw
                    if zz == 0.0 and not (0.0 <= uz * uw <= uw * uw):
                        continue
                    # Gradient of the quadric, brought to the camera frame by the transposed inverse.
                    gx = M[0, 0] * ux + M[1, 0] * uy + zz * M[2, 0] * uz - M[3, 0] * uw
                    gy = M[0, 1] * ux + M[1, 1] * uy + zz * M[2, 1] * uz - M[3, 1] * uw
                    gz = M[0, 2] * ux + M[1, 2] * uy + zz * M[2, 2] * uz - M[3, 2] * uw
                    length = math.sqrt(gx * gx + gy * gy + gz * gz)
                    if gx * dx + gy * dy + gz >= 0.0 or length == 0.0:
                        continue  # the ray leaves the solid here
                    depth[v, u] = t
                    label[v, u] = labels[n]
                    normal[v, u, 0] = gx / length
                    normal[v, u, 1] = gy / length
                    normal[v, u, 2] = gz / length
