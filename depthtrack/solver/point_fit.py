"""Fit of the hand to points with known correspondences, such as optical markers.

points = dict(bodies=[0, 0, 3, 6], local_points=offsets, targets=measured)       # NaN: a missing marker
solution = fit_points(Chain.of(shape), **points, start=last_pose, prior=Prior.towards(last_pose[ANGLES], 1e-6))
if not solution.converged: ...
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from depthtrack.geometry.alignment import rigid_alignment
from depthtrack.geometry.rotations import quaternion_from_matrix
from depthtrack.hand.compiled_kinematics import BodyPoses, Chain
from depthtrack.hand.pose import make_pose
from depthtrack.solver.fixed_points import FixedPoints
from depthtrack.solver.gauss_newton import minimise, solve_each
from depthtrack.solver.normal_equations import NormalEquations, clear
from depthtrack.solver.prior import Prior
from depthtrack.solver.problem import Problem, Solution, SolverOptions
from depthtrack.solver.subspace import FULL, PostureSubspace
from depthtrack.types import Array


@dataclass(frozen=True)
class PointFitOptions:
    """Iterations, damping and tolerances of a fit to points.

    iterations: largest number of Gauss-Newton steps.
    damping: lambda of Schroeder et al. 2014, Eq. (4), m^2/rad^2. It only keeps angles without a point at their start.
    pose_damping: the same for the global pose, see `SolverOptions`.
    energy_tolerance: the fit ends after a step that decreases the energy by a smaller share.
    energy_floor: the fit ends after a step that decreases the energy by less, m^2; 1e-17 is a few nanometres.
    halvings: lengths tried for a step.
    """

    iterations: int = 60
    damping: float = 1e-8
    pose_damping: float = 1e-10
    energy_tolerance: float = 1e-8
    energy_floor: float = 1e-17
    halvings: int = 8

    @property
    def solver(self) -> SolverOptions:
        """The options of the solver."""
        return SolverOptions(
            self.iterations,
            self.damping,
            self.pose_damping,
            step_tolerance=0.0,
            energy_tolerance=self.energy_tolerance,
            energy_floor=self.energy_floor,
            halvings=self.halvings,
        )


def fit_points(
    chain: Chain,
    bodies: ArrayLike,
    local_points: ArrayLike,
    targets: ArrayLike,
    *,
    start: Array,
    weights: ArrayLike | None = None,
    directions: ArrayLike | None = None,
    prior: Prior | None = None,
    subspace: PostureSubspace = FULL,
    options: PointFitOptions | None = None,
) -> Solution:
    """Return the pose within the limits with points closest to their targets.

    bodies: (N,) body of each point.
    local_points: (N, 3) metres, frame of the body.
    targets: (N, 3) metres, camera frame, NaN if missing.
    start: (27,) pose to start from.
    weights: (N,), 1 by default.
    directions: (N, 3) unit, camera frame. The distance counts along them; in all coordinates by default or if zero.
    prior: on the angles, added to the unscaled sum over the points.

    Raises:
        ValueError: if a body is not one of the 16, or if the arrays differ in length.
    """
    points = FixedPoints.of(bodies, local_points, targets, weights, directions)
    equations = NormalEquations.empty()
    clear(equations, BodyPoses.at(chain, start))
    problem = Problem(chain, equations, points, prior or Prior.none(), subspace)
    return minimise(problem, (options or PointFitOptions()).solver, start)


def fit_points_each(
    chain: Chain,
    bodies: ArrayLike,
    local_points: ArrayLike,
    targets: Array,
    weights: Array,
    starts: Array,
    options: PointFitOptions | None = None,
) -> tuple[Array, Array]:
    """Return the poses (B, 27) of `fit_points` for B hands, and their energies (B,), m^2.

    bodies: (N,) body of each point.
    local_points: (N, 3) metres, body frames.
    targets: (B, N, 3) metres, camera frame, finite.
    weights: (B, N), 0 for a missing point.
    starts: (B, 27) within the limits.
    """
    count = len(np.asarray(bodies))
    points = FixedPoints.of(bodies, local_points, np.zeros((count, 3)))
    problem = Problem(chain, NormalEquations.empty(), points, Prior.none(), FULL)
    poses, energies = np.array(starts, dtype=np.float64), np.empty(len(starts))
    weights = np.ascontiguousarray(weights, dtype=np.float64)
    targets = np.ascontiguousarray(targets, dtype=np.float64)
    solve_each(problem, (options or PointFitOptions()).solver, targets, weights, poses, energies)
    return poses, energies


def aligned_poses(angles: Array, points: Array, targets: Array, weights: Array) -> Array:
    """Return poses (..., 27) of fixed angles with points closest to targets (Horn 1987).

    angles: (20,) rad.
    points: (N, 3) metres, palm frame, of the hand with these angles.
    targets: (..., N, 3) metres, camera frame, finite.
    weights: (..., N), some of them positive.
    """
    R, t = rigid_alignment(points, targets, weights)
    return make_pose(t, quaternion_from_matrix(R), angles)
