"""Correspondences with the visible points of a surface given by points with normals.

A posed point is visible if it faces the camera and no nearer point hides it. The visible points are sorted into cells
of the image. The search visits the cells around an observed point until no other cell can contain a closer point.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from depthtrack.compilation import compiled
from depthtrack.hand.compiled_kinematics import BodyPoses
from depthtrack.segmentation.observation import Observation
from depthtrack.simd.vectors import kernel_part
from depthtrack.solver.closest_points import FAR, LANES, Groups, closest_vertices, grouped
from depthtrack.solver.correspondences import Correspondences, PointCloud
from depthtrack.solver.options import SurfaceOptions
from depthtrack.types import Array, Array32, Index

_MOST_CELLS = 512
"""Most cells of a row or column, which bound the memory."""


class SurfacePoints(NamedTuple):
    """Points of a hand's surface at rest.

    rest, normals: (V, 3) points and outward unit normals, metres, rest frame.
    bodies, weights: (V, 4) bodies that move each point and their weights, largest first.
    T_body_rest: (16, 3, 4) rest frame to body frames.
    """

    rest: Array
    normals: Array
    bodies: Index
    weights: Array
    T_body_rest: Array


def subsample_evenly(points: Array, spacing: float) -> Index:
    """Return increasing rows of points (N, 3) that are at least `spacing` (m) apart."""
    tree, free, picked = cKDTree(points), np.ones(len(points), np.bool_), []
    for i in range(len(points)):
        if free[i]:
            picked.append(i)
            free[tree.query_ball_point(points[i], spacing)] = False
    return np.array(picked)


class Posed(NamedTuple):
    """Points of a posed hand.

    x: (V, 3) metres, camera frame.
    n: (V, 3) outward unit normals, camera frame.
    """

    x: Array
    n: Array


class Visible(NamedTuple):
    """Visible points sorted by cell.

    first: (C + 1,) cell c contains the rows from first[c] up to first[c + 1].
    vertex: (S,) rows of the posed points.
    table: (6, S + LANES) coordinates (m) relative to `origin`, and unit normals; the last LANES columns are padding.
    origin: (3,) metres, camera frame.
    """

    first: Index
    vertex: Index
    table: Array32
    origin: Array


class Cells(NamedTuple):
    """Square cells of the image plane z = 1.

    u, v: corner of the first cell.
    size: side of a cell.
    rows, columns: numbers of cells.
    """

    u: float
    v: float
    size: float
    rows: int
    columns: int


class PointSurface:
    """Surface given by points: see `correspondences.Surface`."""

    def __init__(self, points: SurfacePoints, options: SurfaceOptions) -> None:
        self._points, self._options = points, options
        self._posed = Posed(np.empty_like(points.rest), np.empty_like(points.rest))

    def set_target(self, observation: Observation, cloud: PointCloud, max_distance: float) -> None:
        self._max_distance = max_distance
        self._cells = cells_over(cloud.points, self._options.cell, max_distance)
        self._groups: list[tuple[PointCloud, Groups]] = []

    def match(
        self,
        pose: Array,
        bodies: BodyPoses,
        cloud: PointCloud,
        min_normal_cosine: float,
        correspondences: Correspondences,
    ) -> None:
        limits = (self._options.hidden_depth, self._max_distance, min_normal_cosine)
        groups = self._groups_of(cloud)
        match_points(self._points, bodies, self._posed, self._cells, cloud, groups, limits, correspondences)

    def _groups_of(self, cloud: PointCloud) -> Groups:
        """Return the groups of a cloud of the target, made at its first search."""
        for known, groups in self._groups:
            if known is cloud:
                return groups
        self._groups.append((cloud, grouped(cloud.points, cloud.normals, self._cells)))
        return self._groups[-1][1]


@compiled(nogil=True)
def match_points(
    points: SurfacePoints,
    bodies: BodyPoses,
    posed: Posed,
    cells: Cells,
    cloud: PointCloud,
    groups: Groups,
    limits: tuple[float, float, float],
    correspondences: Correspondences,
) -> None:
    """Write the closest visible points to `correspondences`, and the posed points to `posed`.

    limits: `sort_visible`'s tolerance, largest distance (m), smallest cosine between the normals.
    """
    tolerance, max_distance, min_normal_cosine = limits
    pose_points(points, bodies, posed)
    visible = sort_visible(posed, cells, tolerance)
    closest_vertices(cloud, groups, visible, cells, max_distance, min_normal_cosine, correspondences.body)
    resolve_bodies(points, posed, visible, correspondences)


@compiled(nogil=True)
def pose_points(points: SurfacePoints, bodies: BodyPoses, posed: Posed) -> None:
    """Write the posed points and normals to `posed`, by linear blend skinning."""
    A = np.empty((16, 12))
    for b in range(16):
        T, R = bodies.T[b], points.T_body_rest[b]
        for i in range(3):
            for j in range(4):
                A[b, 4 * i + j] = T[i, 0] * R[0, j] + T[i, 1] * R[1, j] + T[i, 2] * R[2, j]
            A[b, 4 * i + 3] += T[i, 3]
    m = np.empty(12)
    for v in range(points.rest.shape[0]):
        w, b = points.weights[v, 0], points.bodies[v, 0]
        for j in range(12):
            m[j] = w * A[b, j]
        for k in range(1, 4):
            w, b = points.weights[v, k], points.bodies[v, k]
            if w == 0.0:
                break
            for j in range(12):
                m[j] += w * A[b, j]
        x, y, z = points.rest[v, 0], points.rest[v, 1], points.rest[v, 2]
        nx, ny, nz = points.normals[v, 0], points.normals[v, 1], points.normals[v, 2]
        length = 0.0
        for i in range(3):
            posed.x[v, i] = m[4 * i] * x + m[4 * i + 1] * y + m[4 * i + 2] * z + m[4 * i + 3]
            n = m[4 * i] * nx + m[4 * i + 1] * ny + m[4 * i + 2] * nz
            posed.n[v, i] = n
            length += n * n
        length = 1.0 / math.sqrt(max(length, 1e-30))
        for i in range(3):
            posed.n[v, i] *= length


@compiled(nogil=True)
def cells_over(points: Array, size: float, margin: float) -> Cells:
    """Return the cells that cover the image of points and a margin around it.

    points: (N, 3) metres, camera frame.
    size, margin: side of a cell and width of the margin, metres at the mean depth of the points. Cells are larger where
        a side would need more than _MOST_CELLS.
    """
    if points.shape[0] == 0:
        return Cells(0.0, 0.0, 1.0, 1, 1)
    low_u = low_v = 1e9
    high_u = high_v = -1e9
    depth = 0.0
    for i in range(points.shape[0]):
        z = points[i, 2]
        u, v = points[i, 0] / z, points[i, 1] / z
        low_u, high_u, low_v, high_v = min(low_u, u), max(high_u, u), min(low_v, v), max(high_v, v)
        depth += z
    depth /= points.shape[0]
    around = margin / depth
    width, height = high_u - low_u + 2 * around, high_v - low_v + 2 * around
    side = max(size / depth, max(width, height) / (_MOST_CELLS - 1))
    columns = min(int(width / side) + 1, _MOST_CELLS)
    rows = min(int(height / side) + 1, _MOST_CELLS)
    return Cells(low_u - around, low_v - around, side, rows, columns)


@compiled(nogil=True)
def sort_visible(posed: Posed, cells: Cells, tolerance: float) -> Visible:
    """Return the visible points, sorted by cell.

    A point is hidden if it faces away, or lies more than `tolerance` (m) behind the nearest point of its cell.
    """
    count = posed.x.shape[0]
    cell = np.empty(count, np.int64)
    nearest = np.full(cells.rows * cells.columns, 1e9)
    for v in range(count):
        x, y, z = posed.x[v, 0], posed.x[v, 1], posed.x[v, 2]
        cell[v] = -1
        facing = posed.n[v, 0] * x + posed.n[v, 1] * y + posed.n[v, 2] * z
        if z <= 1e-3 or facing >= 0.0:
            continue
        column, row = math.floor((x / z - cells.u) / cells.size), math.floor((y / z - cells.v) / cells.size)
        if 0 <= column < cells.columns and 0 <= row < cells.rows:
            cell[v] = row * cells.columns + column
            nearest[cell[v]] = min(nearest[cell[v]], z)
    first = np.zeros(cells.rows * cells.columns + 1, np.int64)
    for v in range(count):
        if cell[v] >= 0 and posed.x[v, 2] > nearest[cell[v]] + tolerance:
            cell[v] = -1
        if cell[v] >= 0:
            first[cell[v] + 1] += 1
    for c in range(1, first.shape[0]):
        first[c] += first[c - 1]
    total = first[-1]
    visible = Visible(first, np.empty(total, np.int64), np.full((6, total + LANES), FAR), posed.x[0].copy())
    slots = first[:-1].copy()
    for v in range(count):
        if cell[v] < 0:
            continue
        k = slots[cell[v]]
        slots[cell[v]] += 1
        visible.vertex[k] = v
        for j in range(3):
            visible.table[j, k], visible.table[3 + j, k] = posed.x[v, j] - visible.origin[j], posed.n[v, j]
    return visible


@kernel_part
def resolve_bodies(points: SurfacePoints, posed: Posed, visible: Visible, correspondences: Correspondences) -> None:
    """Replace the rows of visible points in `correspondences.body` by bodies; write `x` and `n`.

    Each point counts as fixed to the body with its largest weight.
    """
    for i in range(correspondences.body.shape[0]):
        if correspondences.body[i] >= 0:
            v = visible.vertex[correspondences.body[i]]
            correspondences.body[i] = points.bodies[v, 0]
            for j in range(3):
                correspondences.x[i, j], correspondences.n[i, j] = posed.x[v, j], posed.n[v, j]
