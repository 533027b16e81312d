"""The point cloud of a depth map with normals."""

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.geometry.camera import Camera
from depthtrack.segmentation.options import PointCloudOptions
from depthtrack.simd.functions import vabs, vsqrt
from depthtrack.simd.vectors import F64X8, both, kernel_part, loader, select, store
from depthtrack.types import Array, Depth, Index

LANES = F64X8.lanes
_load = loader(F64X8)


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
    pixels = _every_reading(depth, every)
    points, normals = np.empty((len(pixels), 3)), np.empty((len(pixels), 3))
    intrinsics = (camera.fx, camera.fy, camera.cx, camera.cy)
    _fit(depth, pixels, intrinsics, options.sample_spacing, options.same_surface, points, normals)
    return points, normals


@compiled(nogil=True)
def count_readings(depth: Depth) -> int:
    """Return the number of pixels with a reading."""
    total = 0
    for v in range(depth.shape[0]):
        row = depth[v]
        for u in range(row.shape[0]):
            total += row[u] != 0.0
    return total


@compiled(nogil=True)
def _every_reading(depth: Depth, every: int) -> Index:
    """Return row and column (N, 2) of every n-th pixel with a reading."""
    width, first = depth.shape[1], every // 2
    total = max(count_readings(depth) - first + every - 1, 0) // every
    columns, pixels = np.empty(width + 1, np.int64), np.empty((total, 2), np.int64)
    n, wait = 0, first
    for v in range(depth.shape[0]):
        row, count = depth[v], 0
        for u in range(width):
            columns[count] = u
            count += row[u] != 0.0
        while wait < count:
            pixels[n, 0], pixels[n, 1] = v, columns[wait]
            n, wait = n + 1, wait + every
        wait -= count
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
    samples, found = np.empty((9, LANES)), np.empty((5, LANES))
    for start in range(0, pixels.shape[0], LANES):
        for lane in range(LANES):
            # Lanes beyond the last pixel repeat it.
            n = min(start + lane, pixels.shape[0] - 1)
            v, u = pixels[n, 0], pixels[n, 1]
            found[0, lane], found[1, lane] = (u - cx) / fx, (v - cy) / fy
            inside = spacing <= v < height - spacing and spacing <= u < width - spacing
            for k in range(9):
                j, i = v + spacing * (k // 3 - 1), u + spacing * (k % 3 - 1)
                there = inside or (0 <= j < height and 0 <= i < width)
                samples[k, lane] = depth[j, i] if there else 0.0
        _fit_block(samples, (fx, fy), spacing, same_surface, found)
        for lane in range(min(LANES, pixels.shape[0] - start)):
            n, z = start + lane, samples[4, lane]
            points[n, 0], points[n, 1], points[n, 2] = found[0, lane] * z, found[1, lane] * z, z
            normals[n, 0], normals[n, 1], normals[n, 2] = found[2, lane], found[3, lane], found[4, lane]


@kernel_part
def _fit_block(samples: Array, focal: tuple[float, float], spacing: int, same_surface: float, found: Array) -> None:
    """Write the normals of eight pixels.

    samples: (9, LANES) depths of the 3x3 samples of each pixel, metres; 0 without a reading.
    found: (5, LANES) x, y of the pixels in the image plane z = 1; receives the normals as its last three rows.
    """
    (fx, fy), z = focal, _load(samples[4], 0)
    nothing = z - z
    count, su, sv, suu, suv, svv = nothing, nothing, nothing, nothing, nothing, nothing
    sw, suw, svw = nothing, nothing, nothing
    for k in range(9):
        i, j = float(spacing * (k % 3 - 1)), float(spacing * (k // 3 - 1))
        there = _load(samples[k], 0)
        same = both(there > 0.0, same_surface >= vabs(there - z))
        used, w = select(same, nothing + 1.0, nothing), select(same, 1.0 / there, nothing)
        count, su, sv, sw = count + used, su + used * i, sv + used * j, sw + w
        suu, suv, svv = suu + used * (i * i), suv + used * (i * j), svv + used * (j * j)
        suw, svw = suw + w * i, svw + w * j
    # Slopes of w about the mean of the samples.
    a, b, c = suu - su * su / count, suv - su * sv / count, svv - sv * sv / count
    p, q = suw - su * sw / count, svw - sv * sw / count
    determinant = a * c - b * b
    wu, wv = (c * p - b * q) / determinant, (a * q - b * p) / determinant
    # w = n.(x, y, 1) / d for the plane n.X = d.
    x, y = _load(found[0], 0), _load(found[1], 0)
    fits = both(count > 3.5, determinant > 1e-9)
    nx, ny = select(fits, wu * fx, x), select(fits, wv * fy, y)
    nz = select(fits, 1.0 / z - x * nx - y * ny, nothing + 1.0)
    scale = -1.0 / vsqrt(nx * nx + ny * ny + nz * nz)
    store(found[2], 0, nx * scale)
    store(found[3], 0, ny * scale)
    store(found[4], 0, nz * scale)
