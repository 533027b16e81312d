"""Fit of one model's pose to its labelled points (Maycock et al. 2015, Eq. 4 to 6)."""

from typing import NamedTuple

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.hand.compiled_kinematics import BodyPoses
from depthtrack.hand.limits import LOWER, UPPER
from depthtrack.markers.labelling.scene import Scene, chain_of
from depthtrack.solver.fixed_points import FixedPoints
from depthtrack.solver.gauss_newton import solve
from depthtrack.solver.normal_equations import NormalEquations
from depthtrack.solver.prior import Prior
from depthtrack.solver.problem import Problem, SolverOptions, SolverState
from depthtrack.solver.subspace import PostureSubspace
from depthtrack.types import Array, Index, Mask

_LOWER, _UPPER, _FULL = np.array(LOWER), np.array(UPPER), np.eye(20)


class PoseFit(NamedTuple):
    """Iterations and damping of the fit.

    damping: of each finger angle, m^2/rad^2.
    """

    iterations: int
    damping: float
    avoid_limits: bool


@compiled(nogil=True)
def fit_pose(
    scene: Scene,
    g: int,
    fit: PoseFit,
    targets: Array,
    weights: Array,
    frozen: Mask,
    pose: Array,
    slope: Array,
    bodies: BodyPoses,
) -> None:
    """Move `pose` (27,) of model g to a minimum of Eq. (4).

    targets: (M, 3) metres, finite where the weight is positive; those of other models are not read.
    weights: (M,) factors of the squared distances; 0 for a missing marker.
    frozen: (20,) angles that keep their values.
    slope: (20,) of the joint limit function at the previous step, updated.
    bodies: receive the transforms of the pose.
    """
    first, last = scene.first[g], scene.first[g + 1]
    count = 0 if scene.rigid[g] else 20
    lower, upper, coordinates = np.empty(count), np.empty(count), np.empty(count)
    for a in range(count):
        x = min(max(pose[7 + a], _LOWER[a]), _UPPER[a])
        pose[7 + a], coordinates[a] = x, x
        lower[a], upper[a] = (x, x) if frozen[a] else (_LOWER[a], _UPPER[a])
    points = FixedPoints(
        scene.body[first:last],
        scene.local[first:last],
        targets[first:last],
        np.zeros((last - first, 3)),
        weights[first:last],
    )
    # Distances are exact for fixed points, so the sums of found correspondences stay empty.
    equations = NormalEquations(np.zeros((16, 6, 8)), np.zeros(16), np.zeros((16, 3, 4)), pose[:3].copy())
    space = PostureSubspace(_FULL[:, :count].copy(), np.zeros(20), lower, upper, count == 20)
    problem = Problem(chain_of(scene, g), equations, points, Prior(np.zeros((20, 20)), np.zeros(20)), space)
    options = SolverOptions(fit.iterations, fit.damping, 1e-9, fit.avoid_limits, 2e-5, 0.0, 1e-14, 6)
    solve(problem, options, bodies, SolverState(pose, coordinates, slope[:count]), np.empty(fit.iterations + 1))


@compiled(nogil=True)
def determined_angles(scene: Scene, g: int, point: Index, out: Mask) -> None:
    """Write whether each angle (20,) of model g moves a marker that has a point."""
    out[:] = False
    for i in range(scene.first[g], scene.first[g + 1]):
        if point[i] >= 0:
            for a in range(20):
                out[a] |= scene.moves[i, a]
