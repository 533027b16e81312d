"""Closest points on the model of tapered capsules, an elliptic palm and the ball of the thumb (Sec. VI-C).

Each of the 16 bodies has one part: body 0 the palm, an elliptic cylinder between two halves of ellipsoids, body 1 the
ellipsoid of the thumb, the rest a capsule each. All parts are tried for all points, one after the other, so that the
compiler can take several points at a time.
"""

import math
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from depthtrack.hand.kinematics import BODY_COUNT
from depthtrack.hand.primitives import Primitives
from depthtrack.hand.shape import HandShape
from depthtrack.observation.observation import Observation
from depthtrack.rendering.raster import RasterScorer
from depthtrack.rendering.target import Target
from depthtrack.tracking.ik.chain import Bodies
from depthtrack.tracking.ik.matching import Cloud, Matches

Array = NDArray[np.float64]

_NEWTON = 8
"""Steps to the foot point on an ellipsoid; they converge from one side and quadratically."""
_HIDDEN = 0.006
"""Metres behind the rendered hand at which a point counts as hidden: pixels are coarse, and surfaces slanted."""
_RESOLUTION = 96


class Parts(NamedTuple):
    """`capsules` (16, 4): start along the bone, length, radius at the start and what it loses per metre (rows 0 and 1
    unused); `ball` (2, 3) centre and semi-axes of the thumb's ellipsoid in its body's frame; `palm` (6,): middle in x,
    bottom and top in y, half breadth, half thickness; then `caps` (2,) lengths of the palm's ends. Metres."""

    capsules: Array
    ball: Array
    palm: Array
    caps: Array

    @staticmethod
    def of(shape: HandShape) -> "Parts":
        """From the primitives' matrices, so that there is one model of spheres and cylinders, not two."""
        primitives = Primitives.of(shape)
        T = dict(zip(primitives.names, primitives.T_body_unit, strict=True))
        body_of = dict(zip(primitives.names, primitives.bodies, strict=True))
        capsules = np.zeros((BODY_COUNT, 4))
        for name, body in body_of.items():
            if "_cone_" in name:
                start = T[name] @ np.array([0, 0, 0, 1.0])
                end = T[name] @ np.array([0, 0, 1.0, 1.0])
                edge = T[name] @ np.array([1.0, 0, 1.0, 1.0])
                radius, length = abs(T[name][0, 0]), end[1] / end[3] - start[1]
                taper = (radius - abs(edge[0] / edge[3])) / length
                capsules[body] = start[1], length, radius, min(max(taper, -0.99), 0.99)
        ball, palm = T["thumb_ellipsoid"], T["palm_cylinder"]
        bottom, top = T["palm_wrist_cap"], T["palm_knuckle_cap"]
        return Parts(
            capsules,
            np.stack([ball[:3, 3], np.abs(np.diag(ball)[:3])]),
            np.array([palm[0, 3], bottom[1, 3], top[1, 3], abs(bottom[0, 0]), abs(bottom[2, 2])]),
            np.abs(np.array([bottom[1, 1], top[1, 1]])),
        )


class CapsuleSurface:
    """See the module, and `matching.Surface`."""

    def __init__(self, shape: HandShape, agreement: float) -> None:
        self._agreement = agreement
        self._parts = Parts.of(shape)
        self._scorer = RasterScorer(shape)

    def observe(self, observation: Observation, cloud: Cloud, reach: float) -> None:
        target = Target(observation.camera, observation.skin, observation.depth).reduced(_RESOLUTION)
        self._scorer.observe(target)
        c = target.camera
        self._lens = (c.fx, c.fy, c.cx, c.cy)
        self._cloud, self._reach = cloud, reach
        count = len(cloud.points)
        self._matches = Matches.room(count)
        self._distance = np.empty((BODY_COUNT, count))

    def match(self, pose: Array, bodies: Bodies) -> Matches:
        rendered = self._scorer.render(pose)
        distances(self._cloud.points, self._parts, bodies, self._distance)
        limits = (self._reach, self._agreement)
        choose(self._cloud, self._parts, bodies, self._distance, rendered, self._lens, limits, self._matches)
        return self._matches


@numba.njit(cache=True, nogil=True, error_model="numpy")
def distances(points: Array, parts: Parts, bodies: Bodies, out: Array) -> None:
    """Distance (16, N) in metres of each point (N, 3) to the surface of each part."""
    for body in range(BODY_COUNT):
        T = bodies.T[body]
        if body == 0:
            _palm_distances(points, parts, T, out[0])
        elif body == 1:
            _ball_distances(points, parts, T, out[1])
        else:
            start, length, radius, taper = parts.capsules[body]
            ax, ay, az = T[0, 1], T[1, 1], T[2, 1]
            cx, cy, cz = T[0, 3] + start * ax, T[1, 3] + start * ay, T[2, 3] + start * az
            # The nearest of the balls that sweep the capsule lies where the cone's normal leads, not straight across.
            lean = taper / math.sqrt(1.0 - taper * taper)
            for i in range(points.shape[0]):
                x, y, z = points[i, 0] - cx, points[i, 1] - cy, points[i, 2] - cz
                along = x * ax + y * ay + z * az
                across = math.sqrt(max(x * x + y * y + z * z - along * along, 0.0))
                t = min(max(along - across * lean, 0.0), length)
                rest = along - t
                out[body, i] = abs(math.sqrt(rest * rest + across * across) - (radius - taper * t))


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _palm_distances(points: Array, parts: Parts, T: Array, out: Array) -> None:
    for i in range(points.shape[0]):
        x, y, z = _local(points, i, T)
        x -= parts.palm[0]
        y, cap = _beyond(y, parts)
        fx, fy, fz = _foot(x, y, z, parts.palm[3], cap, parts.palm[4])
        out[i] = math.sqrt((x - fx) ** 2 + (y - fy) ** 2 + (z - fz) ** 2)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _ball_distances(points: Array, parts: Parts, T: Array, out: Array) -> None:
    c, r = parts.ball[0], parts.ball[1]
    for i in range(points.shape[0]):
        x, y, z = _local(points, i, T)
        x, y, z = x - c[0], y - c[1], z - c[2]
        fx, fy, fz = _foot(x, y, z, r[0], r[1], r[2])
        out[i] = math.sqrt((x - fx) ** 2 + (y - fy) ** 2 + (z - fz) ** 2)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _local(points: Array, i: int, T: Array) -> tuple[float, float, float]:
    x, y, z = points[i, 0] - T[0, 3], points[i, 1] - T[1, 3], points[i, 2] - T[2, 3]
    return (
        T[0, 0] * x + T[1, 0] * y + T[2, 0] * z,
        T[0, 1] * x + T[1, 1] * y + T[2, 1] * z,
        T[0, 2] * x + T[1, 2] * y + T[2, 2] * z,
    )


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _beyond(y: float, parts: Parts) -> tuple[float, float]:
    """How far y lies beyond the palm's cylinder, and the length of the cap there."""
    bottom, top = parts.palm[1], parts.palm[2]
    beyond = y - top if y > top else (y - bottom if y < bottom else 0.0)
    return beyond, (parts.caps[1] if y > top else parts.caps[0])


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _foot(x: float, y: float, z: float, a: float, b: float, c: float) -> tuple[float, float, float]:
    """The nearest point of the ellipsoid with semi-axes a, b, c (Eberly, "Distance from a point to an ellipse, an
    ellipsoid, or a hyperellipsoid", 2013): it is (a^2 x / (t + a^2), ...) for the largest root t of a convex function.
    """
    a2, b2, c2 = a * a, b * b, c * c
    least = min(a2, min(b2, c2))
    t = max(max(a * abs(x) - a2, b * abs(y) - b2), max(c * abs(z) - c2, 1e-6 * least - least))
    for _ in range(_NEWTON):
        ra, rb, rc = 1 / (t + a2), 1 / (t + b2), 1 / (t + c2)
        u, v, w = a * x * ra, b * y * rb, c * z * rc
        value = u * u + v * v + w * w - 1
        slope = -2 * (u * u * ra + v * v * rb + w * w * rc)
        t = max(t - value / min(slope, -1e-12), 1e-6 * least - least)
    return a2 * x / (t + a2), b2 * y / (t + b2), c2 * z / (t + c2)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def choose(
    cloud: Cloud,
    parts: Parts,
    bodies: Bodies,
    distance: Array,
    rendered: NDArray[np.float32],
    lens: tuple[float, float, float, float],
    limits: tuple[float, float],
    matches: Matches,
) -> None:
    """The nearest part whose closest point is seen and faces as observed; its point and normal into `matches`."""
    x, n = matches.x, matches.n
    reach, agreement = limits
    for i in range(cloud.points.shape[0]):
        matches.body[i] = -1
        passed = -1.0
        while True:
            body, best = -1, reach
            for k in range(BODY_COUNT):
                if passed < distance[k, i] < best:
                    body, best = k, distance[k, i]
            if body < 0:
                break
            passed = best
            surface_point(cloud.points, i, body, parts, bodies, x, n)
            same = n[i, 0] * cloud.normals[i, 0] + n[i, 1] * cloud.normals[i, 1] + n[i, 2] * cloud.normals[i, 2]
            facing = n[i, 0] * x[i, 0] + n[i, 1] * x[i, 1] + n[i, 2] * x[i, 2] < 0
            if facing and same >= agreement and not _hidden(x, i, rendered, lens):
                matches.body[i] = body
                break


@numba.njit(cache=True, nogil=True, error_model="numpy")
def surface_point(points: Array, i: int, body: int, parts: Parts, bodies: Bodies, x: Array, n: Array) -> None:
    """The point of a part closest to point i, and the outward normal there, into row i of `x` and `n`."""
    T = bodies.T[body]
    if body >= 2:
        start, length, radius, taper = parts.capsules[body]
        lean = taper / math.sqrt(1.0 - taper * taper)
        along = -start
        for j in range(3):
            along += (points[i, j] - T[j, 3]) * T[j, 1]
        square = 0.0
        for j in range(3):
            square += (points[i, j] - T[j, 3] - (start + along) * T[j, 1]) ** 2
        t = min(max(along - math.sqrt(square) * lean, 0.0), length)
        norm = 1 / max(math.sqrt(square + (along - t) ** 2), 1e-12)
        for j in range(3):
            centre = T[j, 3] + (start + t) * T[j, 1]
            n[i, j] = (points[i, j] - centre) * norm
            x[i, j] = centre + (radius - taper * t) * n[i, j]
        return
    px, py, pz = _local(points, i, T)
    if body == 0:
        a, c, ox = parts.palm[3], parts.palm[4], parts.palm[0]
        beyond, b = _beyond(py, parts)
        oy, oz = py - beyond, 0.0
    else:
        a, b, c = parts.ball[1]
        ox, oy, oz = parts.ball[0]
    fx, fy, fz = _foot(px - ox, py - oy, pz - oz, a, b, c)
    gx, gy, gz = fx / (a * a), fy / (b * b), fz / (c * c)
    norm = 1 / max(math.sqrt(gx * gx + gy * gy + gz * gz), 1e-12)
    for j in range(3):
        x[i, j] = T[j, 0] * (ox + fx) + T[j, 1] * (oy + fy) + T[j, 2] * (oz + fz) + T[j, 3]
        n[i, j] = (T[j, 0] * gx + T[j, 1] * gy + T[j, 2] * gz) * norm


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _hidden(x: Array, i: int, rendered: NDArray[np.float32], lens: tuple[float, float, float, float]) -> bool:
    """Whether the rendered hand lies in front of a point."""
    fx, fy, cx, cy = lens
    z = x[i, 2]
    u, v = round(x[i, 0] / z * fx + cx), round(x[i, 1] / z * fy + cy)
    if 0 <= u < rendered.shape[1] and 0 <= v < rendered.shape[0]:
        front = rendered[v, u]
        return front > 0 and z > front + _HIDDEN
    return False
