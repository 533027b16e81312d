"""Robust residuals of correspondences: point to point, point to plane, or symmetric."""

from depthtrack.simd.functions import eight
from depthtrack.simd.vectors import F64X8, kernel_part, loader, store
from depthtrack.solver.correspondences import Correspondences, PointCloud
from depthtrack.solver.normal_equations import ROW, NormalEquations
from depthtrack.solver.options import Residual
from depthtrack.solver.robust import compiled_geman_mcclure, compiled_symmetric_direction
from depthtrack.types import Array

_load = loader(F64X8)


def add_correspondences(
    equations: NormalEquations,
    correspondences: Correspondences,
    cloud: PointCloud,
    residual: Residual,
    kernel_scale: float,
) -> None:
    """Add the residuals of all correspondences to the normal equations.

    kernel_scale: m, scale of the Geman-McClure kernel, see `geman_mcclure`; 0 for equal weights.
    """
    add = add_points if residual == "point" else add_symmetric if residual == "symmetric" else add_planes
    add(equations.sums.reshape(-1), equations.e, equations.centre, correspondences, cloud, kernel_scale)


@kernel_part
def add_planes(
    sums: Array, total: Array, centre: Array, correspondences: Correspondences, cloud: PointCloud, kernel_scale: float
) -> None:
    """Add the distances of correspondences along the normals of the hand."""
    for i in range(correspondences.body.shape[0]):
        if correspondences.body[i] >= 0:
            n = correspondences.n[i]
            _add(sums, total, centre, correspondences, cloud, i, kernel_scale, n[0], n[1], n[2])


@kernel_part
def add_symmetric(
    sums: Array, total: Array, centre: Array, correspondences: Correspondences, cloud: PointCloud, kernel_scale: float
) -> None:
    """Add the distances of correspondences along the mean of both normals."""
    for i in range(correspondences.body.shape[0]):
        if correspondences.body[i] >= 0:
            n, m = correspondences.n[i], cloud.normals[i]
            x, y, z = compiled_symmetric_direction(n[0], n[1], n[2], m[0], m[1], m[2])
            _add(sums, total, centre, correspondences, cloud, i, kernel_scale, x, y, z)


@kernel_part
def add_points(
    sums: Array, total: Array, centre: Array, correspondences: Correspondences, cloud: PointCloud, kernel_scale: float
) -> None:
    """Add the distances of correspondences in all three coordinates."""
    for i in range(correspondences.body.shape[0]):
        if correspondences.body[i] >= 0:
            _add(sums, total, centre, correspondences, cloud, i, kernel_scale, 1.0, 0.0, 0.0)
            _add(sums, total, centre, correspondences, cloud, i, kernel_scale, 0.0, 1.0, 0.0)
            _add(sums, total, centre, correspondences, cloud, i, kernel_scale, 0.0, 0.0, 1.0)


@kernel_part
def _add(
    sums: Array,
    total: Array,
    centre: Array,
    correspondences: Correspondences,
    cloud: PointCloud,
    i: int,
    kernel_scale: float,
    nx: float,
    ny: float,
    nz: float,
) -> None:
    """Add the residual of correspondence i along a unit direction n."""
    b, x, y = correspondences.body[i], correspondences.x[i], cloud.points[i]
    ex, ey, ez = x[0] - y[0], x[1] - y[1], x[2] - y[2]
    px, py, pz = x[0] - centre[0], x[1] - centre[1], x[2] - centre[2]
    # The gradient by v is n, by w it is p x n.
    tx, ty, tz = py * nz - pz * ny, pz * nx - px * nz, px * ny - py * nx
    w, e = weight(ex, ey, ez, kernel_scale), nx * ex + ny * ey + nz * ez
    row, at = eight(nx, ny, nz, tx, ty, tz, e, 0.0), ROW * 6 * b
    store(sums, at, _load(sums, at) + row * (w * nx))
    store(sums, at + ROW, _load(sums, at + ROW) + row * (w * ny))
    store(sums, at + 2 * ROW, _load(sums, at + 2 * ROW) + row * (w * nz))
    store(sums, at + 3 * ROW, _load(sums, at + 3 * ROW) + row * (w * tx))
    store(sums, at + 4 * ROW, _load(sums, at + 4 * ROW) + row * (w * ty))
    store(sums, at + 5 * ROW, _load(sums, at + 5 * ROW) + row * (w * tz))
    total[b] += w * e * e


@kernel_part
def weight(ex: float, ey: float, ez: float, kernel_scale: float) -> float:
    """Return the Geman-McClure weight of a distance vector (m); 1 if `kernel_scale` is 0."""
    if kernel_scale <= 0.0:
        return 1.0
    return compiled_geman_mcclure(ex * ex + ey * ey + ez * ez, kernel_scale)
