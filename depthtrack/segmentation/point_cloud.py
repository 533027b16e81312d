"""The point cloud of a depth map with normals."""

import math

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.geometry.camera import Camera
from depthtrack.segmentation.options import PointCloudOptions
from depthtrack.types import Array, Depth, Index


def point_cloud(
    camera: Camera, depth: Depth, options: PointCloudOptions | None = None, every: int = 1
) -> tuple[Array, Array]:
    """Return the points and unit normals of a depth map, row by row.

    depth: (h, w), metres; 0 without a reading.
    every: step between the pixels that give a point (Schroeder et al. 2014, Sec. VI-B).
    points: (N, 3), metres, camera frame.
    normals: (N, 3), towards the camera.

    A plane's inverse depth is linear in the pixel. So each normal comes from a linear fit of the inverse depth to 3x3
    samples around its pixel. Samples on another surface or without a reading are left out. If fewer than four remain,
    the normal is the line of sight.
    """
    options = options or PointCloudOptions()
    pixels = _every_reading(depth, every, len(range(every // 2, np.count_nonzero(depth), every)))
    points, normals = np.empty((len(pixels), 3)), np.empty((len(pixels), 3))
    intrinsics = (camera.fx, camera.fy, camera.cx, camera.cy)
    _fit(depth, pixels, intrinsics, options.sample_spacing, options.same_surface, points, normals)
    return points, normals


@compiled(nogil=True)
def _every_reading(depth: Depth, every: int, count: int) -> Index:
    """Return row and column (count, 2) of every n-th pixel with a reading."""
    pixels, wait, n = np.empty((count, 2), np.int64), every // 2, 0
    for v in range(depth.shape[0]):
        for u in range(depth.shape[1]):
            if depth[v, u] != 0.0:
                if wait == 0:
                    pixels[n, 0], pixels[n, 1] = v, u
                    n, wait = n + 1, every
                wait -= 1
    return pixels


@compiled(nogil=True)
def _fit(
    depth: Depth,
    pixels: Index,
    intrinsics: tuple[float, float, float, float],
    spacing: int,
    same_surface: float,
    points: Array,
    normals: Array,
) -> None:
    """Write points and normals of pixels, row and column (N, 2)."""
    fx, fy, cx, cy = intrinsics
    height, width = depth.shape
    for n in range(pixels.shape[0]):
        v, u = pixels[n, 0], pixels[n, 1]
        z = np.float64(depth[v, u])
        x, y = (u - cx) / fx, (v - cy) / fy
        points[n, 0], points[n, 1], points[n, 2] = x * z, y * z, z
        count, su, sv, suu, suv, svv, sw, suw, svw = 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for j in range(-spacing, spacing + 1, spacing):
            for i in range(-spacing, spacing + 1, spacing):
                if not (0 <= v + j < height and 0 <= u + i < width):
                    continue
                there = np.float64(depth[v + j, u + i])
                if there == 0.0 or abs(there - z) > same_surface:
                    continue
                w = 1.0 / there
                count += 1
                su, sv, sw = su + i, sv + j, sw + w
                suu, suv, svv = suu + i * i, suv + i * j, svv + j * j
                suw, svw = suw + i * w, svw + j * w
        # Slopes of w about the mean of the samples.
        nx, ny, nz = x, y, 1.0
        if count >= 4:
            a, b, c = suu - su * su / count, suv - su * sv / count, svv - sv * sv / count
            p, q = suw - su * sw / count, svw - sv * sw / count
            determinant = a * c - b * b
            if determinant > 1e-9:
                wu, wv = (c * p - b * q) / determinant, (a * q - b * p) / determinant
                # w = n.(x, y, 1) / d for the plane n.X = d.
                nx, ny = wu * fx, wv * fy
                nz = 1.0 / z - x * nx - y * ny
        length = -math.sqrt(nx * nx + ny * ny + nz * nz)
        normals[n, 0], normals[n, 1], normals[n, 2] = nx / length, ny / length, nz / length
