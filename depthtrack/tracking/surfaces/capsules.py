"""Closest points on tapered capsules (cylinders in Schroeder et al. 2014, Sec. VI-C).

A capsule is the union of balls along its axis, with a linear radius. The distances of all points to one capsule are
computed together, which the compiler vectorises.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from depthtrack.compilation import compiled
from depthtrack.geometry.capsules import compiled_nearest_ball
from depthtrack.hand.compiled_kinematics import BodyPoses
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.scorer import Scorer
from depthtrack.segmentation.observation import Observation
from depthtrack.simd.vectors import kernel_part
from depthtrack.solver.correspondences import Correspondences, PointCloud
from depthtrack.solver.options import SurfaceOptions
from depthtrack.tracking.surfaces.capsule_fit import Capsules, fitted_capsules
from depthtrack.types import Array, Array32, Depth


class PosedCapsules(NamedTuple):
    """Axes of the capsules of a posed hand.

    start: (K, 3) metres, camera frame.
    axis: (K, 3) unit, camera frame.
    """

    start: Array
    axis: Array


class Distances(NamedTuple):
    """Distances of points to the surfaces of capsules.

    each: (K, N) metres.
    least: (N,) smallest distance of each point, metres.
    which: (N,) row of the capsule at that distance.
    """

    each: Array32
    least: Array32
    which: NDArray[np.int32]

    @staticmethod
    def allocate(capsules: int, points: int) -> "Distances":
        """Allocate the distances of `points` points to `capsules` capsules."""
        each = np.empty((capsules, points), np.float32)
        return Distances(each, np.empty(points, np.float32), np.empty(points, np.int32))


class RenderedHand(NamedTuple):
    """Depth map of the rendered hand.

    depth: (h, w) metres, 0 for none.
    lens: fx, fy, cx, cy, pixels.
    hidden_depth: metres behind the depth map from which on a point is hidden.
    """

    depth: Depth
    lens: tuple[float, float, float, float]
    hidden_depth: float


class CapsuleSurface:
    """Surface of tapered capsules: see `solver.surface.Surface`."""

    def __init__(self, shape: HandShape, scorer: Scorer, options: SurfaceOptions) -> None:
        self._options = options
        self._capsules = fitted_capsules(shape)
        self._posed = PosedCapsules(np.empty_like(self._capsules.start), np.empty_like(self._capsules.start))
        self._scorer = scorer

    def set_target(self, observation: Observation, cloud: PointCloud, max_distance: float) -> None:
        target = observation.reduced(self._options.cylinder_resolution)
        self._scorer.set_target(target)
        c = target.camera
        self._lens = (c.fx, c.fy, c.cx, c.cy)
        self._max_distance = max_distance
        self._distances = Distances.allocate(len(self._capsules.body), len(cloud.points))

    def arranged(self, cloud: PointCloud) -> PointCloud:
        return cloud

    def search(self, cloud: PointCloud) -> None:
        return None

    def twin(self) -> None:
        return None

    def match(
        self,
        pose: Array,
        bodies: BodyPoses,
        cloud: PointCloud,
        min_normal_cosine: float,
        correspondences: Correspondences,
    ) -> None:
        rendered = RenderedHand(self._scorer.render(pose), self._lens, self._options.cylinder_hidden_depth)
        pose_capsules(self._capsules, bodies, self._posed)
        measure(cloud.points, self._capsules, self._posed, self._distances)
        limits = (self._max_distance, min_normal_cosine)
        choose(cloud, self._capsules, self._posed, self._distances, rendered, limits, correspondences)


@compiled(nogil=True)
def pose_capsules(capsules: Capsules, bodies: BodyPoses, posed: PosedCapsules) -> None:
    """Write the capsules of a posed hand to `posed`."""
    for k in range(capsules.body.shape[0]):
        T = bodies.T[capsules.body[k]]
        for i in range(3):
            posed.start[k, i], posed.axis[k, i] = T[i, 3], 0.0
            for j in range(3):
                posed.start[k, i] += T[i, j] * capsules.start[k, j]
                posed.axis[k, i] += T[i, j] * capsules.axis[k, j]


@compiled(nogil=True, fastmath=True)
def measure(points: Array, capsules: Capsules, posed: PosedCapsules, out: Distances) -> None:
    """Write the distances of points to all capsules to `out`.

    points: (N, 3) metres, camera frame.
    out: distances of at least N points.

    The distance is `geometry.capsules.capsule_distance`, unsigned and in single precision, written for vectorisation.
    """
    count = points.shape[0]
    each, least, which = out
    # Single precision doubles the points per instruction. Its error is below a micrometre.
    px, py, pz = np.empty(count, np.float32), np.empty(count, np.float32), np.empty(count, np.float32)
    for i in range(count):
        px[i], py[i], pz[i] = points[i, 0], points[i, 1], points[i, 2]
        least[i] = np.float32(1e9)
    nothing = np.float32(0.0)
    for k in range(capsules.body.shape[0]):
        cx, cy, cz = np.float32(posed.start[k, 0]), np.float32(posed.start[k, 1]), np.float32(posed.start[k, 2])
        ax, ay, az = np.float32(posed.axis[k, 0]), np.float32(posed.axis[k, 1]), np.float32(posed.axis[k, 2])
        length, radius = np.float32(capsules.length[k]), np.float32(capsules.radius[k])
        taper = np.float32(capsules.taper[k])
        lean = taper / np.float32(math.sqrt(1.0 - taper * taper))
        distance, number = each[k], np.int32(k)
        for i in range(count):
            x, y, z = px[i] - cx, py[i] - cy, pz[i] - cz
            along = x * ax + y * ay + z * az
            square = max(x * x + y * y + z * z - along * along, nothing)
            t = min(max(along - np.sqrt(square) * lean, nothing), length)
            rest = along - t
            d = abs(np.sqrt(rest * rest + square) - (radius - taper * t))
            distance[i] = d
            nearer = d < least[i]
            least[i] = d if nearer else least[i]
            which[i] = number if nearer else which[i]


@kernel_part
def choose(
    cloud: PointCloud,
    capsules: Capsules,
    posed: PosedCapsules,
    distances: Distances,
    rendered: RenderedHand,
    limits: tuple[float, float],
    correspondences: Correspondences,
) -> None:
    """Write the closest point on the nearest admissible capsule to `correspondences`.

    A capsule is admissible if its closest point is visible and its normal agrees with the observed one.

    limits: largest distance (m) and smallest cosine between the normals, see `solver.surface.Surface`.
    """
    x, n, normals = correspondences.x, correspondences.n, cloud.normals
    max_distance, min_normal_cosine = limits
    for i in range(cloud.points.shape[0]):
        correspondences.body[i] = -1
        k, distance = distances.which[i], distances.least[i]
        while distance < max_distance:
            surface_point(cloud.points, i, capsules, posed, k, x, n)
            same = n[i, 0] * normals[i, 0] + n[i, 1] * normals[i, 1] + n[i, 2] * normals[i, 2]
            if same >= min_normal_cosine and not _hidden(x, i, rendered):
                correspondences.body[i] = capsules.body[k]
                break
            # Continue with the next nearest capsule.
            passed, distance = distance, max_distance
            for j in range(capsules.body.shape[0]):
                if passed < distances.each[j, i] < distance:
                    k, distance = j, distances.each[j, i]


@kernel_part
def surface_point(points: Array, i: int, capsules: Capsules, posed: PosedCapsules, k: int, x: Array, n: Array) -> None:
    """Write the point of capsule k closest to point i, and its normal, to row i of `x` and `n`.

    x: (N, 3) metres, camera frame.
    n: (N, 3) outward unit normals, camera frame.

    A point on the far side is replaced by its mirror image on the visible side.
    """
    taper = capsules.taper[k]
    along = square = 0.0
    for j in range(3):
        along += (points[i, j] - posed.start[k, j]) * posed.axis[k, j]
    for j in range(3):
        square += (points[i, j] - posed.start[k, j] - along * posed.axis[k, j]) ** 2
    t = compiled_nearest_ball(along, math.sqrt(square), taper, capsules.length[k])
    radius = capsules.radius[k] - taper * t
    scale = 1 / max(math.sqrt(square + (along - t) ** 2), 1e-12)
    sight = square = 0.0
    for j in range(3):
        x[i, j] = posed.start[k, j] + t * posed.axis[k, j]
        n[i, j] = (points[i, j] - x[i, j]) * scale
        sight += n[i, j] * x[i, j]
        square += x[i, j] * x[i, j]
    if sight > 0:
        for j in range(3):
            n[i, j] -= 2 * sight / square * x[i, j]
    for j in range(3):
        x[i, j] += radius * n[i, j]


@kernel_part
def _hidden(x: Array, i: int, rendered: RenderedHand) -> bool:
    """Return whether the rendered hand hides row i of x (N, 3)."""
    fx, fy, cx, cy = rendered.lens
    z = x[i, 2]
    u, v = round(x[i, 0] / z * fx + cx), round(x[i, 1] / z * fy + cy)
    if 0 <= u < rendered.depth.shape[1] and 0 <= v < rendered.depth.shape[0]:
        front = rendered.depth[v, u]
        return front > 0 and z > front + rendered.hidden_depth
    return False
