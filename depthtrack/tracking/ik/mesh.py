"""Closest points on the skin mesh, among those that the camera can see.

The posed vertices that face the camera, and that nothing nearer hides, are sorted into cells of the image; an
observed point looks through the cells around its own until no other can hold a closer vertex.
"""

import math
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from depthtrack.hand.shape import HandShape
from depthtrack.hand.skin import Skin
from depthtrack.observation.observation import Observation
from depthtrack.tracking.ik.chain import Bodies
from depthtrack.tracking.ik.matching import Cloud, Matches

Array = NDArray[np.float64]
Index = NDArray[np.int64]


_CELL = 0.004
"""Side of a cell, metres at the hand's distance: a little more than a vertex' distance to its neighbours."""
_HIDDEN = 0.008
"""Metres behind the nearest vertex of its cell at which a vertex counts as hidden."""


class MeshModel(NamedTuple):
    """The skin at rest: `rest` and `normals` (V, 3), the `bodies` (V, 4) that move a vertex and their `weights` (V, 4),
    largest first, and `T_body_rest` (16, 3, 4)."""

    rest: Array
    normals: Array
    bodies: Index
    weights: Array
    T_body_rest: Array

    @staticmethod
    def of(skin: Skin) -> "MeshModel":
        """From a skin; more than four bodies a vertex do not occur."""
        order = np.argsort(-skin.weights, axis=1, kind="stable")[:, :4]
        weights = np.take_along_axis(skin.weights, order, axis=1)
        return MeshModel(
            np.ascontiguousarray(skin.rest),
            np.ascontiguousarray(skin.normals(skin.rest)),
            np.ascontiguousarray(order),
            np.ascontiguousarray(weights / weights.sum(axis=1, keepdims=True)),
            np.ascontiguousarray(skin.T_body_rest[:, :3]),
        )


class Posed(NamedTuple):
    """Posed vertices `x` (V, 3), their outward normals `n` (V, 3) and whether the camera sees them."""

    x: Array
    n: Array
    seen: NDArray[np.bool_]


class Cells(NamedTuple):
    """Cells of the image plane z = 1: (rows, columns) of side `size` from corner (`u`, `v`)."""

    u: float
    v: float
    size: float
    rows: int
    columns: int


class MeshSurface:
    """See the module, and `matching.Surface`."""

    def __init__(self, shape: HandShape, agreement: float) -> None:
        self._agreement = agreement
        self._model = MeshModel.of(Skin.of(shape))
        count = len(self._model.rest)
        self._posed = Posed(np.empty((count, 3)), np.empty((count, 3)), np.zeros(count, np.bool_))

    def observe(self, observation: Observation, cloud: Cloud, reach: float) -> None:
        self._cloud, self._reach = cloud, reach
        self._matches = Matches.room(len(cloud.points))
        self._cells = cells_over(cloud.points, _CELL, reach)

    def match(self, pose: Array, bodies: Bodies) -> Matches:
        skin_vertices(self._model, bodies, self._posed)
        first, members = sort_seen(self._posed, self._cells, _HIDDEN)
        limits = (self._reach, self._agreement)
        closest_vertices(self._cloud, self._model, self._posed, self._cells, first, members, limits, self._matches)
        return self._matches


@numba.njit(cache=True, nogil=True)
def skin_vertices(model: MeshModel, bodies: Bodies, posed: Posed) -> None:
    """Pose vertices and normals by linear blend skinning."""
    A = np.empty((16, 12))
    for b in range(16):
        T, R = bodies.T[b], model.T_body_rest[b]
        for i in range(3):
            for j in range(4):
                A[b, 4 * i + j] = T[i, 0] * R[0, j] + T[i, 1] * R[1, j] + T[i, 2] * R[2, j]
            A[b, 4 * i + 3] += T[i, 3]
    m = np.empty(12)
    for v in range(model.rest.shape[0]):
        w, b = model.weights[v, 0], model.bodies[v, 0]
        for j in range(12):
            m[j] = w * A[b, j]
        for k in range(1, 4):
            w, b = model.weights[v, k], model.bodies[v, k]
            if w == 0.0:
                break
            for j in range(12):
                m[j] += w * A[b, j]
        x, y, z = model.rest[v, 0], model.rest[v, 1], model.rest[v, 2]
        nx, ny, nz = model.normals[v, 0], model.normals[v, 1], model.normals[v, 2]
        length = 0.0
        for i in range(3):
            posed.x[v, i] = m[4 * i] * x + m[4 * i + 1] * y + m[4 * i + 2] * z + m[4 * i + 3]
            n = m[4 * i] * nx + m[4 * i + 1] * ny + m[4 * i + 2] * nz
            posed.n[v, i] = n
            length += n * n
        length = 1.0 / math.sqrt(max(length, 1e-30))
        for i in range(3):
            posed.n[v, i] *= length


@numba.njit(cache=True, nogil=True)
def cells_over(points: Array, size: float, margin: float) -> Cells:
    """Cells over the image of points (N, 3) and `margin` (m) around it; `size` is a cell's side in metres at the
    points' mean depth."""
    low_u = low_v = 1e9
    high_u = high_v = -1e9
    depth = 0.0
    for i in range(points.shape[0]):
        z = points[i, 2]
        u, v = points[i, 0] / z, points[i, 1] / z
        low_u, high_u, low_v, high_v = min(low_u, u), max(high_u, u), min(low_v, v), max(high_v, v)
        depth += z
    depth /= points.shape[0]
    side, around = size / depth, margin / depth
    columns = min(int((high_u - low_u + 2 * around) / side) + 1, 512)
    rows = min(int((high_v - low_v + 2 * around) / side) + 1, 512)
    return Cells(low_u - around, low_v - around, side, rows, columns)


@numba.njit(cache=True, nogil=True)
def sort_seen(posed: Posed, cells: Cells, tolerance: float) -> tuple[Index, Index]:
    """Find what the camera sees, and sort it: `first` (cells + 1,) into `members`, the vertices by cell.

    A vertex is hidden when it lies more than `tolerance` (m) behind the nearest one of its cell, or faces away.
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
        posed.seen[v] = cell[v] >= 0 and posed.x[v, 2] <= nearest[cell[v]] + tolerance
        if posed.seen[v]:
            first[cell[v] + 1] += 1
    for c in range(1, first.shape[0]):
        first[c] += first[c - 1]
    members, place = np.empty(first[-1], np.int64), first[:-1].copy()
    for v in range(count):
        if posed.seen[v]:
            members[place[cell[v]]] = v
            place[cell[v]] += 1
    return first, members


@numba.njit(cache=True, nogil=True)
def closest_vertices(
    cloud: Cloud,
    model: MeshModel,
    posed: Posed,
    cells: Cells,
    first: Index,
    members: Index,
    limits: tuple[float, float],
    matches: Matches,
) -> None:
    """The seen vertex closest to each point: see `matching.Surface`. It counts as fixed to the body that moves it
    most."""
    points, normals = cloud.points, cloud.normals
    reach, agreement = limits
    for i in range(points.shape[0]):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        nx, ny, nz = normals[i, 0], normals[i, 1], normals[i, 2]
        u, v = x / z, y / z
        column, row = math.floor((u - cells.u) / cells.size), math.floor((v - cells.v) / cells.size)
        best, chosen = reach * reach, -1
        # A plane through the lens at distance d in the image lies d z / sqrt(1 + u^2) from the point, or more.
        scale = cells.size * z / math.sqrt(1.0 + max(abs(u), abs(v)) ** 2 * 1.2)
        ring = 0
        while ring == 0 or (ring - 1) * scale * (ring - 1) * scale < best:
            for r in range(row - ring, row + ring + 1):
                if r < 0 or r >= cells.rows:
                    continue
                edge = r == row - ring or r == row + ring
                c = column - ring
                while c <= column + ring:
                    if 0 <= c < cells.columns:
                        index = r * cells.columns + c
                        for m in range(first[index], first[index + 1]):
                            k = members[m]
                            dx, dy, dz = posed.x[k, 0] - x, posed.x[k, 1] - y, posed.x[k, 2] - z
                            d = dx * dx + dy * dy + dz * dz
                            if d < best and nx * posed.n[k, 0] + ny * posed.n[k, 1] + nz * posed.n[k, 2] >= agreement:
                                best, chosen = d, k
                    c += 1 if edge or ring == 0 else 2 * ring
            ring += 1
        matches.body[i] = -1
        if chosen >= 0:
            matches.body[i] = model.bodies[chosen, 0]
            for j in range(3):
                matches.x[i, j], matches.n[i, j] = posed.x[chosen, j], posed.n[chosen, j]
