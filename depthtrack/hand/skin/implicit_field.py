"""Signed distance to the implicit hand, compiled: cones, webs and their smooth unions.

Points are evaluated in blocks, so that the compiler uses SIMD instructions. Products are fused as BLAS fuses them.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.simd.functions import fused
from depthtrack.types import Array, Index

_BLOCK = 128
"""Points evaluated together."""


_LEAST = 1e-18
"""Squared length, m^2, that is added to that of an axis, which may be zero."""


@dataclass(frozen=True)
class Cone:
    """A tapered capsule from `start` to `end` (3,), with the radius at each end."""

    start: Array
    end: Array
    radius_start: float
    radius_end: float


@dataclass(frozen=True)
class Web:
    """A web: parallel strands between two edges, thinner towards the far end.

    `one`, `other` (2, 3): near and far end of each edge.
    `radius_near`, `radius_far`: half the thickness at these ends.
    """

    one: Array
    other: Array
    radius_near: float
    radius_far: float


class ConeTable(NamedTuple):
    """Tapered capsules in groups.

    start, axis, slope: (C, 3) start, vector to the end, and that over its squared length.
    radius, growth: (C,) at the start, and from there to the end.
    first: (G + 1,) group g contains the cones from first[g] up to first[g + 1].
    """

    start: Array
    axis: Array
    slope: Array
    radius: Array
    growth: Array
    first: Index

    @staticmethod
    def of(groups: Sequence[Sequence[Cone]]) -> "ConeTable":
        """Return the table of some cones in groups."""
        cones = [cone for group in groups for cone in group]
        axes = [cone.end - cone.start for cone in cones]
        return ConeTable(
            np.array([cone.start for cone in cones]),
            np.array(axes),
            np.array([axis / (axis @ axis + _LEAST) for axis in axes]),
            np.array([cone.radius_start for cone in cones]),
            np.array([cone.radius_end - cone.radius_start for cone in cones]),
            np.cumsum([0, *map(len, groups)]),
        )


class WebTable(NamedTuple):
    """Webs between two edges.

    one, other: (W, 3) near end of each edge.
    along_one, along_other: (W, 3) vector to the far end.
    near, slope: (W, 3) middle of the near ends, and the vector from there to the far middle over its squared length.
    radius, growth: (W,) at the near end, and from there to the far end.
    """

    one: Array
    other: Array
    along_one: Array
    along_other: Array
    near: Array
    slope: Array
    radius: Array
    growth: Array

    @staticmethod
    def of(webs: Sequence[Web]) -> "WebTable":
        """Return the table of some webs."""
        middles = [(web.one + web.other) / 2 for web in webs]
        along = [far - near for near, far in middles]
        return WebTable(
            np.array([web.one[0] for web in webs]),
            np.array([web.other[0] for web in webs]),
            np.array([web.one[1] - web.one[0] for web in webs]),
            np.array([web.other[1] - web.other[0] for web in webs]),
            np.array([near for near, _ in middles]),
            np.array([each / (each @ each + _LEAST) for each in along]),
            np.array([web.radius_near for web in webs]),
            np.array([web.radius_far - web.radius_near for web in webs]),
        )


class Field(NamedTuple):
    """The solid hand.

    palm: cones of each ray; a ray's cones meet without a fillet.
    muscles, webs: one group.
    fingers: cones of each finger.
    palm_fillet, muscle_fillet, web_fillet: m.
    finger_fillets: (5,) between the cones of a finger.
    base_fillets: (5,) between a finger and the hand.
    wrist: (3,) height of the cut, m, distance of the surface from it, and its fillet.
    """

    palm: ConeTable
    muscles: ConeTable
    webs: WebTable
    fingers: ConeTable
    palm_fillet: float
    muscle_fillet: float
    web_fillet: float
    finger_fillets: Array
    base_fillets: Array
    wrist: Array


@compiled(nogil=True, error_model="numpy")
def hand_distance(field: Field, points: Array) -> Array:
    """Return the signed distance (N,) of points (N, 3) to the skin."""
    out, one, whole = np.empty(len(points)), np.empty(_BLOCK), np.empty(_BLOCK)
    for begin in range(0, len(points), _BLOCK):
        p = np.ascontiguousarray(points[begin : begin + _BLOCK].T)
        n = p.shape[1]
        body, found = whole[:n], out[begin : begin + n]
        _palm(field, p, one, body)
        for k in range(field.muscles.radius.shape[0]):
            _cone(field.muscles, k, p, one)
            _unite(body, one, field.muscle_fillet)
        for k in range(field.webs.radius.shape[0]):
            _web(field.webs, k, p, one)
            _unite(body, one, field.web_fillet)
        for i in range(n):
            body[i] = -body[i]
            one[i] = p[1, i] - field.wrist[0] + field.wrist[1]
        _unite(body, one, field.wrist[2])
        for i in range(n):
            body[i] = -body[i]
        # Each finger is blended with the hand alone, so that adjacent fingers stay apart.
        finger = np.empty(n)
        for f in range(5):
            _finger(field, f, p, one, finger)
            _unite(finger, body, field.base_fillets[f])
            for i in range(n):
                found[i] = finger[i] if f == 0 or finger[i] < found[i] else found[i]
    return out


@compiled(nogil=True, error_model="numpy")
def part_distances(field: Field, points: Array) -> Array:
    """Return the signed distances (6, N) of points (N, 3) to parts of the hand.

    They are the palm without muscles and webs, and each finger alone.
    """
    p, one = np.ascontiguousarray(points.T), np.empty(len(points))
    out = np.empty((6, len(points)))
    _palm(field, p, one, out[0])
    for finger in range(5):
        _finger(field, finger, p, one, out[1 + finger])
    return out


@compiled(nogil=True, error_model="numpy")
def _palm(field: Field, p: Array, one: Array, out: Array) -> None:
    """Write the distance (n,) of points p (3, n) to the palm."""
    first, ray = field.palm.first, np.empty(p.shape[1])
    for g in range(first.shape[0] - 1):
        target = out if g == 0 else ray
        _cone(field.palm, first[g], p, target)
        # The cones of one ray meet without a fillet, which would swell where they join.
        for k in range(first[g] + 1, first[g + 1]):
            _cone(field.palm, k, p, one)
            for i in range(p.shape[1]):
                target[i] = one[i] if one[i] < target[i] else target[i]
        if g > 0:
            _unite(out, ray, field.palm_fillet)


@compiled(nogil=True, error_model="numpy")
def _finger(field: Field, finger: int, p: Array, one: Array, out: Array) -> None:
    """Write the distance (n,) of points p (3, n) to a finger."""
    first = field.fingers.first
    _cone(field.fingers, first[finger], p, out)
    for k in range(first[finger] + 1, first[finger + 1]):
        _cone(field.fingers, k, p, one)
        _unite(out, one, field.finger_fillets[finger])


@compiled(nogil=True, error_model="numpy")
def _unite(a: Array, b: Array, k: float) -> None:
    """Write the union of two solids to `a`.

    k: width of the fillet, m, which adds at most k / 4.
    """
    for i in range(a.shape[0]):
        x, y = a[i], b[i]
        h = k - abs(x - y)
        h = (h if h > 0.0 else 0.0) / k
        a[i] = (x if x < y else y) - h * h * k / 4


@compiled(nogil=True, error_model="numpy")
def _cone(cones: ConeTable, k: int, p: Array, out: Array) -> None:
    """Write the distance (n,) of points p (3, n) to a cone, perpendicular to the axis."""
    sx, sy, sz = cones.start[k, 0], cones.start[k, 1], cones.start[k, 2]
    ax, ay, az = cones.axis[k, 0], cones.axis[k, 1], cones.axis[k, 2]
    vx, vy, vz = cones.slope[k, 0], cones.slope[k, 1], cones.slope[k, 2]
    radius, growth = cones.radius[k], cones.growth[k]
    for i in range(p.shape[1]):
        x, y, z = p[0, i] - sx, p[1, i] - sy, p[2, i] - sz
        t = fused(z, vz, fused(x, vx, y * vy))
        t = t if t > 0.0 else 0.0
        t = t if t < 1.0 else 1.0
        x, y, z = x - t * ax, y - t * ay, z - t * az
        out[i] = math.sqrt(x * x + z * z + y * y) - (radius + t * growth)


@compiled(nogil=True, error_model="numpy")
def _web(webs: WebTable, k: int, p: Array, out: Array) -> None:
    """Write the distance (n,) of points p (3, n) to the nearest strand of a web."""
    near, slope, one, other = webs.near[k], webs.slope[k], webs.one[k], webs.other[k]
    along_one, along_other = webs.along_one[k], webs.along_other[k]
    radius, growth = webs.radius[k], webs.growth[k]
    for i in range(p.shape[1]):
        x, y, z = p[0, i] - near[0], p[1, i] - near[1], p[2, i] - near[2]
        t = fused(z, slope[2], fused(x, slope[0], y * slope[1]))
        t = t if t > 0.0 else 0.0
        t = t if t < 1.0 else 1.0
        bx, by, bz = one[0] + t * along_one[0], one[1] + t * along_one[1], one[2] + t * along_one[2]
        ux = other[0] + t * along_other[0] - bx
        uy = other[1] + t * along_other[1] - by
        uz = other[2] + t * along_other[2] - bz
        x, y, z = p[0, i] - bx, p[1, i] - by, p[2, i] - bz
        square = ux * ux + uz * uz + uy * uy
        s = (x * ux + z * uz + y * uy) / (square if square > 1e-18 else 1e-18)
        s = s if s > 0.0 else 0.0
        s = s if s < 1.0 else 1.0
        x, y, z = x - s * ux, y - s * uy, z - s * uz
        out[i] = math.sqrt(x * x + z * z + y * y) - (radius + t * growth)
