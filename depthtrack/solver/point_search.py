"""Rounds of ICP with the visible points of a surface, in one kernel.

A round poses the surface, finds the correspondences of a cloud, and solves for the pose.
"""

from typing import NamedTuple

from depthtrack.compilation import compiled
from depthtrack.hand.compiled_kinematics import BodyPoses, forward_kinematics
from depthtrack.simd.vectors import kernel_part
from depthtrack.solver.closest_points import Groups, closest_vertices
from depthtrack.solver.correspondences import Correspondences, PointCloud
from depthtrack.solver.gauss_newton import solve
from depthtrack.solver.normal_equations import clear
from depthtrack.solver.problem import Outcome, Problem, SolverOptions, SolverState
from depthtrack.solver.residuals import add_planes, add_points, add_symmetric
from depthtrack.solver.surface_points import PointBlocks, pose_blocks
from depthtrack.solver.visible_points import Cells, Visible, sort_visible
from depthtrack.types import Array

KINDS = {"point": 0, "plane": 1, "symmetric": 2}
"""Numbers of the residuals of `options.Residual`."""


class PointSearch(NamedTuple):
    """A cloud, and the surface whose visible points correspond to it.

    posed: (6, P) working memory: posed points, metres, camera frame, and unit normals.
    cloud: observed points in the order of their groups.
    origin: (3,) metres, camera frame, that the groups refer to.
    hidden_depth: metres behind the nearest point of its cell at which a point is hidden.
    max_distance: largest distance of a correspondence, metres.
    """

    blocks: PointBlocks
    posed: Array
    cells: Cells
    cloud: PointCloud
    groups: Groups
    origin: Array
    hidden_depth: float
    max_distance: float


class Schedule(NamedTuple):
    """Options of each round.

    residual: one of `KINDS`.
    kernel_scale: (K,) scale of the robust kernel, m.
    min_normal_cosine: (K,) smallest cosine between the normals of a correspondence.
    """

    residual: int
    kernel_scale: Array
    min_normal_cosine: Array


@compiled(nogil=True)
def match_points(
    search: PointSearch, bodies: BodyPoses, min_normal_cosine: float, correspondences: Correspondences
) -> None:
    """Write the closest visible points to `correspondences`."""
    pose_blocks(search.blocks, bodies, search.posed)
    visible = sort_visible(search.posed, search.cells, search.origin, search.hidden_depth)
    limits = search.max_distance, min_normal_cosine
    closest_vertices(search.cloud, search.groups, visible, search.cells, *limits, correspondences.body)
    resolve_bodies(search.blocks, visible, correspondences)


@compiled(nogil=True)
def fit_rounds(
    search: PointSearch,
    correspondences: Correspondences,
    problem: Problem,
    solver: SolverOptions,
    schedule: Schedule,
    bodies: BodyPoses,
    state: SolverState,
    trace: Array,
) -> Outcome:
    """Move `state` by rounds of correspondences and Gauss-Newton, one at least.

    Return the outcome of the last round.

    bodies, trace: as in `gauss_newton.solve`.
    """
    equations, scales = problem.equations, schedule.kernel_scale
    sums = equations.sums.reshape(-1)
    for k in range(scales.shape[0]):
        forward_kinematics(problem.chain, state.pose, bodies)
        match_points(search, bodies, schedule.min_normal_cosine[k], correspondences)
        clear(equations, bodies)
        if schedule.residual == 2:
            add_symmetric(sums, equations.e, equations.centre, correspondences, search.cloud, scales[k])
        elif schedule.residual == 1:
            add_planes(sums, equations.e, equations.centre, correspondences, search.cloud, scales[k])
        else:
            add_points(sums, equations.e, equations.centre, correspondences, search.cloud, scales[k])
        outcome = solve(problem, solver, bodies, state, trace)
    return outcome


@kernel_part
def resolve_bodies(blocks: PointBlocks, visible: Visible, correspondences: Correspondences) -> None:
    """Replace the rows of visible points in `correspondences.body` by bodies; write `x` and `n`.

    Each point counts as fixed to the body with its largest weight.
    """
    body, x, n = correspondences
    for i in range(body.shape[0]):
        if body[i] >= 0:
            k = body[i]
            body[i] = blocks.body[visible.vertex[k]]
            for j in range(3):
                x[i, j], n[i, j] = visible.points[k, j], visible.points[k, 3 + j]
