"""Shared parts of the sensor models: incidence, depth edges, occlusion shadows, dropout."""

import math

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.geometry.camera import Camera
from depthtrack.rendering.rendered_surface import RenderedSurface
from depthtrack.types import Array, Mask

SURELY_FLAT = 0.27
"""Squared cosine of an angle of incidence that is below 60 degrees, whatever its last bits."""
JUMP = 0.02
"""Relative depth difference of neighbouring pixels from which they belong to two surfaces."""


def incidence(surface: RenderedSurface, camera: Camera) -> Array:
    """Return the angle between the surface's normal and the viewing ray.

    Result (h, w): radians; pi / 2 without a surface.
    """
    out = np.empty(surface.depth.shape)
    _incidence(surface.depth, surface.normal, (camera.fx, camera.fy, camera.cx, camera.cy), out)
    return out


def edges(depth: Array, radius: int = 1) -> Mask:
    """Return the depth edges: surface pixels with a discontinuity nearby.

    radius: how far a discontinuity may be in the pixel's row or column, pixels.
    depth (h, w): metres.
    Result (h, w): mask.
    """
    out = np.zeros(depth.shape, dtype=np.bool_)
    _edges(depth, radius, JUMP, out)
    return out


def shadow(depth: Array, camera: Camera, baseline: float) -> Mask:
    """Return the surface pixels that are occluded from a second viewpoint at the right (+x).

    The image pair is rectified. In the second image, each row of the surface is rasterised into an inverse-depth
    buffer, segment by segment. A pixel is occluded if the buffer holds something nearer.

    depth (h, w): metres.
    baseline: distance of the viewpoints, metres.
    Result (h, w): mask.
    """
    out = np.zeros(depth.shape, dtype=np.bool_)
    _shadow(depth, camera.fx * baseline, JUMP, out)
    return out


@compiled(nogil=True, error_model="numpy")
def dropout_probability(
    is_edge: bool, incidence: float, at_edges: float, grazing_start: float, grazing_end: float
) -> float:
    """Return the probability that a pixel has no reading.

    incidence: radians; the probability rises linearly from 0 at `grazing_start` to 1 at `grazing_end`.
    at_edges: probability at depth edges.
    """
    grazing = min(max((incidence - grazing_start) / (grazing_end - grazing_start), 0.0), 1.0)
    return max(grazing, at_edges if is_edge else 0.0)


@compiled(nogil=True)
def _incidence(depth: Array, normal: Array, intrinsics: tuple[float, float, float, float], out: Array) -> None:
    for v in range(depth.shape[0]):
        for u in range(depth.shape[1]):
            out[v, u] = incidence_at(depth, normal, intrinsics, v, u)


@compiled(nogil=True, error_model="numpy")
def incidence_at(depth: Array, normal: Array, intrinsics: tuple[float, float, float, float], v: int, u: int) -> float:
    """Return the `incidence` of a pixel, radians.

    normal: (h, w, 3) unit vectors, camera frame.
    intrinsics: fx, fy, cx, cy, pixels.
    """
    fx, fy, cx, cy = intrinsics
    return incidence_along(depth[v, u], normal[v, u], (u - cx) / fx, (v - cy) / fy)


@compiled(nogil=True, error_model="numpy")
def incidence_along(depth: float, normal: Array, x: float, y: float) -> float:
    """Return the `incidence` at a depth, metres, along the viewing ray (x, y, 1).

    normal: (3,) unit vector, camera frame.
    """
    if depth <= 0.0:
        return math.pi / 2
    cosine = -(normal[0] * x + normal[1] * y + normal[2]) / math.sqrt(x * x + y * y + 1.0)
    return math.acos(min(max(cosine, 0.0), 1.0))


@compiled(nogil=True, error_model="numpy")
def steep_incidence_along(depth: float, normal: Array, x: float, y: float) -> float:
    """Return the `incidence_along` a viewing ray if it may reach 60 degrees, else 0.

    Most angles are smaller, and take no root then.
    """
    along = -(normal[0] * x + normal[1] * y + normal[2])
    if depth > 0.0 and along > 0.0 and along * along > SURELY_FLAT * (x * x + y * y + 1.0):
        return 0.0
    return incidence_along(depth, normal, x, y)


@compiled(nogil=True)
def _edges(depth: Array, radius: int, jump: float, out: Mask) -> None:
    height, width = depth.shape
    for v in range(height):
        row, found = depth[v], out[v]
        for k in range(1, radius + 1):
            above, below = depth[max(v - k, 0)], depth[min(v + k, height - 1)]
            # Without branches, so that the compiler makes vectors of it.
            for u in range(width):
                z = row[u]
                far = (abs(above[u] - z) > jump * z) | (abs(below[u] - z) > jump * z)
                found[u] |= (z > 0.0) & far
            for u in range(k, width):
                found[u] |= (row[u] > 0.0) & (abs(row[u - k] - row[u]) > jump * row[u])
            for u in range(width - k):
                found[u] |= (row[u] > 0.0) & (abs(row[u + k] - row[u]) > jump * row[u])
            # Columns beyond the border repeat it.
            for u in range(min(k, width)):
                found[u] |= (row[u] > 0.0) & (abs(row[0] - row[u]) > jump * row[u])
            for u in range(max(width - k, 0), width):
                found[u] |= (row[u] > 0.0) & (abs(row[width - 1] - row[u]) > jump * row[u])


@compiled(nogil=True, error_model="numpy")
def _shadow(depth: Array, focal_baseline: float, jump: float, out: Mask) -> None:
    height, width = depth.shape
    near, inverse, place = np.empty(width), np.empty(width), np.empty(width)
    for v in range(height):
        row = depth[v]
        # Without branches, so that the compiler makes vectors of it. Pixels without a surface have no place.
        for u in range(width):
            near[u] = 0.0
            inverse[u] = 1.0 / row[u] if row[u] > 0.0 else 0.0
            place[u] = u - focal_baseline * inverse[u]
        for u in range(width):
            z = row[u]
            if z <= 0.0:
                continue
            here, inverse_here = place[u], inverse[u]
            # The segment ends at the right neighbour; an isolated pixel covers its own width.
            continues = u + 1 < width and abs(row[u + 1] - z) <= jump * z
            there = place[u + 1] if continues else here + 1.0
            first, last = math.ceil(min(here, there)), math.floor(max(here, there))
            if first > last:
                continue
            slope = (inverse[u + 1] - inverse_here) / (there - here) if continues and there != here else 0.0
            for k in range(max(first, 0), min(last, width - 1) + 1):
                near[k] = max(near[k], inverse_here + (k - here) * slope)
        for u in range(width):
            if row[u] <= 0.0:
                continue
            k = round(place[u])
            # Pixels outside the second image count as visible, since real second cameras cover a wider field.
            if 0 <= k < width and near[k] > (1.0 + jump) * inverse[u]:
                out[v, u] = True
