"""Compute the residuals of a view's surface and outline in kernels."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from depthtrack.calibration.size_equations import Residuals
from depthtrack.compilation import compiled
from depthtrack.solver.robust import compiled_symmetric_direction
from depthtrack.types import Array, Index

_REACH, _AGREEMENT = 0.04, 0.3
"""Metres and cosine between normals: limits of a correspondence."""


class SeenView(NamedTuple):
    """What a view shows of the hand.

    points, normals: (N, 3) metres, camera frame.
    beyond: (h, w) signed distance to the silhouette in pixels, negative inside.
    outward: (2, h, w) unit, by row and column: away from the silhouette.
    """

    points: Array
    normals: Array
    beyond: Array
    outward: Array


class SeenSkin(NamedTuple):
    """The skin rendered with the camera of a view; see `RenderedSurface`.

    camera: fx, fy, cx, cy.
    """

    depth: Array
    label: NDArray[np.int16]
    normal: Array
    camera: tuple[float, float, float, float]


def surface_residuals(view: SeenView, skin: SeenSkin, palm: Array, wrist: float) -> Residuals:
    """Return the symmetric residuals of observed points and the nearest visible skin.

    palm: (3, 4) T_camera_palm.
    wrist: place along the palm's y axis from which on there are residuals, m.
    """
    return Residuals(*_surface_residuals(view, skin, palm, wrist))


def outline_residuals(view: SeenView, skin: SeenSkin, palm: Array, wrist: float) -> Residuals:
    """Return the residuals from the outline of the visible skin to that of the silhouette.

    palm, wrist: see `surface_residuals`.
    """
    return Residuals(*_outline_residuals(view, skin, palm, wrist))


@compiled(nogil=True)
def _surface_residuals(
    view: SeenView, skin: SeenSkin, palm: Array, wrist: float
) -> tuple[Index, Array, Array, Array, Array]:
    count, kept = view.points.shape[0], 0
    found = _empty(count)
    for k in range(count):
        p, m = view.points[k], view.normals[k]
        if not _is_hand(palm, p[0], p[1], p[2], wrist):
            continue
        row, column = _nearest(skin, p)
        if row < 0:
            continue
        n = skin.normal[row, column]
        if not n[0] * m[0] + n[1] * m[1] + n[2] * m[2] > _AGREEMENT:
            continue
        x, y, z = _unprojected(skin, row, column)
        dx, dy, dz = x - p[0], y - p[1], z - p[2]
        ex, ey, ez = compiled_symmetric_direction(n[0], n[1], n[2], m[0], m[1], m[2])
        found.bodies[kept] = skin.label[row, column]
        found.x[kept, 0], found.x[kept, 1], found.x[kept, 2] = x, y, z
        found.directions[kept, 0], found.directions[kept, 1], found.directions[kept, 2] = ex, ey, ez
        found.errors[kept] = ex * dx + ey * dy + ez * dz
        found.distances[kept] = math.sqrt(dx * dx + dy * dy + dz * dz)
        kept += 1
    return _first(found, kept)


@compiled(nogil=True)
def _outline_residuals(
    view: SeenView, skin: SeenSkin, palm: Array, wrist: float
) -> tuple[Index, Array, Array, Array, Array]:
    height, width = skin.depth.shape
    fx, kept = skin.camera[0], 0
    found = _empty(_outline_length(skin.depth))
    for row in range(height):
        for column in range(width):
            if not _is_outline(skin.depth, row, column):
                continue
            down, right = view.outward[0, row, column], view.outward[1, row, column]
            x, y, z = _unprojected(skin, row, column)
            if (down == 0.0 and right == 0.0) or not _is_hand(palm, x, y, z, wrist):
                continue
            # The outline runs along the outer side of its pixels.
            error = (view.beyond[row, column] + 0.5) * z / fx
            found.bodies[kept] = skin.label[row, column]
            found.x[kept, 0], found.x[kept, 1], found.x[kept, 2] = x, y, z
            found.directions[kept, 0], found.directions[kept, 1] = right, down
            found.directions[kept, 2] = -(right * x + down * y) / z
            found.errors[kept], found.distances[kept] = error, abs(error)
            kept += 1
    return _first(found, kept)


@compiled(nogil=True)
def _nearest(skin: SeenSkin, p: Array) -> tuple[int, int]:
    """Return row and column of the visible skin nearest to p (3,).

    Both are -1 if none is within reach. The search visits squares of pixels around p. It
    ends if the rays beyond them all pass farther away than the best pixel.
    """
    fx, fy, cx, cy = skin.camera
    height, width = skin.depth.shape
    column = min(max(round(fx * p[0] / p[2] + cx), 0), width - 1)
    row = min(max(round(fy * p[1] / p[2] + cy), 0), height - 1)
    best, at_row, at_column = _REACH * _REACH, -1, -1
    for ring in range(max(height, width)):
        if ring > 0:
            least = 1e9
            if column - ring >= 0:
                least = min(least, _beyond_ray(p[0], p[2], (column - ring - cx) / fx))
            if column + ring < width:
                least = min(least, _beyond_ray(p[0], p[2], (column + ring - cx) / fx))
            if row - ring >= 0:
                least = min(least, _beyond_ray(p[1], p[2], (row - ring - cy) / fy))
            if row + ring < height:
                least = min(least, _beyond_ray(p[1], p[2], (row + ring - cy) / fy))
            if least >= best:
                break
        for v in range(max(row - ring, 0), min(row + ring, height - 1) + 1):
            step = 1 if v == row - ring or v == row + ring or ring == 0 else 2 * ring
            for u in range(column - ring, column + ring + 1, step):
                if u < 0 or u >= width or not skin.depth[v, u] > 0.0:
                    continue
                x, y, z = _unprojected(skin, v, u)
                square = (x - p[0]) ** 2 + (y - p[1]) ** 2 + (z - p[2]) ** 2
                if square < best:
                    best, at_row, at_column = square, v, u
    return at_row, at_column


@compiled(nogil=True)
def _beyond_ray(across: float, z: float, slope: float) -> float:
    """Return the squared distance of a point from the rays of one slope, x / z or y / z."""
    return (across - slope * z) ** 2 / (1.0 + slope * slope)


@compiled(nogil=True)
def _unprojected(skin: SeenSkin, row: int, column: int) -> tuple[float, float, float]:
    """Return the point of the skin at a pixel, metres, camera frame."""
    fx, fy, cx, cy = skin.camera
    z = skin.depth[row, column]
    return (column - cx) / fx * z, (row - cy) / fy * z, z


@compiled(nogil=True)
def _is_hand(palm: Array, x: float, y: float, z: float, wrist: float) -> bool:
    """Return whether a point lies on the finger side of the wrist."""
    along = palm[0, 1] * (x - palm[0, 3]) + palm[1, 1] * (y - palm[1, 3]) + palm[2, 1] * (z - palm[2, 3])
    return bool(along > wrist)


@compiled(nogil=True)
def _is_outline(depth: Array, row: int, column: int) -> bool:
    """Return whether a pixel shows skin and one of its four neighbours in the image does not."""
    if not depth[row, column] > 0.0:
        return False
    height, width = depth.shape
    return bool(
        (row > 0 and depth[row - 1, column] == 0.0)
        or (row < height - 1 and depth[row + 1, column] == 0.0)
        or (column > 0 and depth[row, column - 1] == 0.0)
        or (column < width - 1 and depth[row, column + 1] == 0.0)
    )


@compiled(nogil=True)
def _outline_length(depth: Array) -> int:
    """Return the number of pixels of the outline."""
    count = 0
    for row in range(depth.shape[0]):
        for column in range(depth.shape[1]):
            if _is_outline(depth, row, column):
                count += 1
    return count


@compiled(nogil=True)
def _empty(count: int) -> Residuals:
    return Residuals(
        np.empty(count, np.int64), np.empty((count, 3)), np.empty((count, 3)), np.empty(count), np.empty(count)
    )


@compiled(nogil=True)
def _first(residuals: Residuals, count: int) -> tuple[Index, Array, Array, Array, Array]:
    bodies, x, directions, errors, distances = residuals
    return bodies[:count], x[:count], directions[:count], errors[:count], distances[:count]
