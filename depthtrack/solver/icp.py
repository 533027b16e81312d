"""ICP fit of the hand to an observation (Schroeder et al. 2014, Sec. IV-C).

It alternates the search for correspondences and Gauss-Newton.
"""

from copy import copy
from typing import Self

import numpy as np

from depthtrack.geometry.alignment import rigid_alignment
from depthtrack.geometry.rotations import quaternion_from_matrix, rotation_matrix
from depthtrack.hand.compiled_kinematics import BODY_COUNT, BodyPoses, Chain, forward_kinematics
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import ANGLES, ORIENTATION, POSITION, make_pose
from depthtrack.hand.shape import HandShape
from depthtrack.segmentation.observation import Observation
from depthtrack.solver.correspondences import Correspondences, PointCloud
from depthtrack.solver.fixed_points import FixedPoints
from depthtrack.solver.gauss_newton import solve
from depthtrack.solver.keypoints import local_keypoints
from depthtrack.solver.normal_equations import NormalEquations, clear
from depthtrack.solver.options import IcpOptions
from depthtrack.solver.point_search import KINDS, Schedule, fit_rounds
from depthtrack.solver.prior import Prior
from depthtrack.solver.problem import Problem, Solution, SolverOptions, SolverState, limit_gradients
from depthtrack.solver.reprojection import LinesOfSight
from depthtrack.solver.residuals import add_correspondences
from depthtrack.solver.subspace import FULL, PostureSubspace
from depthtrack.solver.surface import Surface
from depthtrack.types import Array

_FREE = Prior.none()
_ONE_POSTURE = PostureSubspace(np.zeros((20, 1)), np.zeros(20), np.array([-1.0]), np.array([1.0]), False)
"""Subspace that is one posture, its mean."""


class IcpFitter:
    """Fits one hand to observations, and holds the working memory for it.

    `solution` describes the last run of Gauss-Newton in the last fit: its energy is that of the last correspondences.
    """

    solution: Solution | None = None

    def __init__(self, shape: HandShape, surface: Surface, options: IcpOptions) -> None:
        self.options = options
        self._surface = surface
        self._chain, self._points = Chain.of(shape), FixedPoints.none()
        self._local = local_keypoints(HandModel(shape))
        self._sight: LinesOfSight | None = None
        self._bodies, self._equations = BodyPoses.empty(), NormalEquations.empty()
        self._twins, self._schedules = dict[int, Self](), dict[tuple[float, ...], Schedule]()

    def twin(self, number: int) -> Self | None:
        """Return a fitter to the same target with its own memory; None if it has to share some.

        number: of the twin; each one is made once per target.
        """
        surface = None if self._sight is not None else self._surface.twin()
        if surface is None:
            return None
        if number not in self._twins:
            other = copy(self)
            other._surface, other._twins = surface, {}
            other._bodies, other._equations = BodyPoses.empty(), NormalEquations.empty()
            other._matches = Correspondences.allocate(len(self._cloud.points))
            other._coarse_matches = Correspondences.allocate(len(self._coarse.points))
            self._twins[number] = other
        return self._twins[number]

    def set_target(self, observation: Observation, every: int) -> None:
        """Set the observation that the next fits are to, and use every n-th of its points."""
        cloud = PointCloud.of(observation, every)
        self._twins.clear()
        self._surface.set_target(observation, cloud, self.options.max_distance)
        self._cloud = self._surface.arranged(cloud)
        self._matches = Correspondences.allocate(len(self._cloud.points))
        step = self.options.coarse_every
        coarse = observation.shared(("coarse cloud", every, step), lambda: cloud.subsampled(step))
        self._coarse = self._surface.arranged(coarse)
        self._coarse_matches = Correspondences.allocate(len(self._coarse.points))
        self._sight, self._points = None, FixedPoints.none()
        if observation.keypoints is not None and self.options.keypoint_weight > 0:
            self._sight = LinesOfSight.of(observation.keypoints, observation.camera, self._local)
            self._points = self._sight.block

    def fit(
        self,
        pose: Array,
        subspace: PostureSubspace = FULL,
        iterations: int | None = None,
        prior: Prior | None = None,
        coarse: bool = False,
        align: bool = True,
    ) -> Array:
        """Return the pose (27,) that fits the observation best.

        pose: (27,) to start from.
        subspace: the parameters that change.
        iterations: replaces `IcpOptions.icp_iterations`.
        coarse: use only the points of the rigid alignment.
        align: align the whole hand first.
        """
        options = self.options
        cloud, correspondences = (self._coarse, self._coarse_matches) if coarse else (self._cloud, self._matches)
        share = len(cloud.points) / options.reference_count
        pull = _FREE if prior is None else prior.scaled(share)
        pose = pose.copy()
        coordinates = subspace.project(pose[ANGLES])
        pose[ANGLES] = subspace.angles(coordinates)
        if align:
            self._align(pose)
        state = SolverState(pose, coordinates, limit_gradients(coordinates, subspace.lower, subspace.upper))
        problem = Problem(self._chain, self._equations, self._points, pull, subspace)
        solver = SolverOptions(
            options.gn_iterations, options.damping * share, options.pose_damping, options.avoid_limits
        )
        iterations = options.icp_iterations if iterations is None else iterations
        progress = tuple(k / max(iterations - 1, 1) for k in range(iterations))
        self.solution = self._solve(problem, solver, state, cloud, correspondences, progress)
        return pose

    def residual(self, pose: Array, scale: float) -> float:
        """Return the mean Geman-McClure cost of a pose (27,), 0 to 1.

        scale: of the kernel, m.

        The points are those of the rigid alignment. A point without a correspondence costs 1.
        """
        self._match(pose, self._coarse, self._coarse_matches, 1.0)
        found = self._coarse_matches.body >= 0
        square = np.sum((self._coarse_matches.x[found] - self._coarse.points[found]) ** 2, axis=1)
        return float(1 - np.sum(1 / (1 + square / scale**2)) / max(len(found), 1))

    def keypoint_trust(self, pose: Array) -> float:
        """Return the trust in the keypoints of the observation at a pose (27,), 0 to 1.

        It is 0 without keypoints.
        """
        if self._sight is None:
            return 0.0
        self._match(pose, self._coarse, self._coarse_matches, 1.0)
        return self._trust(self._coarse_matches)

    def _trust(self, correspondences: Correspondences) -> float:
        """Return the trust in the keypoints, 0 to 1, by those of bodies with correspondences.

        A set that contradicts what is observed, such as that of a hand of the other side, must not place hidden parts.
        """
        assert self._sight is not None
        counts = np.bincount(correspondences.body[correspondences.body >= 0], minlength=BODY_COUNT)
        agreement = self._sight.agreement(self._bodies, self.options.keypoint_scale, counts)
        low, high = self.options.keypoint_trust
        return float(np.clip((agreement - low) / (high - low), 0, 1))

    def _solve(
        self,
        problem: Problem,
        solver: SolverOptions,
        state: SolverState,
        cloud: PointCloud,
        correspondences: Correspondences,
        progress: tuple[float, ...],
    ) -> Solution | None:
        """Move `state` by rounds of correspondences and Gauss-Newton.

        progress: of each round, see `IcpOptions.annealed`.

        Return the solution of the last round, None without any.
        """
        search, trace = self._surface.search(cloud), np.empty(solver.iterations + 1)
        if not progress:
            return None
        if search is not None and self._sight is None:
            schedule = self._schedule(progress)
            outcome = fit_rounds(search, correspondences, problem, solver, schedule, self._bodies, state, trace)
        else:
            for share in progress:
                self._match(state.pose, cloud, correspondences, share)
                outcome = solve(problem, solver, self._bodies, state, trace)
        return Solution.of(state.pose, outcome, trace)

    def _schedule(self, progress: tuple[float, ...]) -> Schedule:
        """Return the options of the rounds at some progress, made once."""
        if progress not in self._schedules:
            scales, cosines = np.array([self.options.annealed(share) for share in progress]).T
            self._schedules[progress] = Schedule(KINDS[self.options.residual], scales, cosines)
        return self._schedules[progress]

    def _match(self, pose: Array, cloud: PointCloud, correspondences: Correspondences, progress: float) -> None:
        """Find the correspondences of a pose (27,), and accumulate their residuals."""
        kernel_scale, min_normal_cosine = self.options.annealed(progress)
        forward_kinematics(self._chain, pose, self._bodies)
        self._surface.match(pose, self._bodies, cloud, min_normal_cosine, correspondences)
        clear(self._equations, self._bodies)
        add_correspondences(self._equations, correspondences, cloud, self.options.residual, kernel_scale)
        if self._sight is not None:
            share = len(cloud.points) / self.options.reference_count
            weight = share * self.options.keypoint_weight * self._trust(correspondences)
            self._sight.reweigh(self._bodies, weight, self.options.keypoint_scale)

    def _align(self, pose: Array) -> None:
        """Move the whole hand onto its correspondences, `pose` (27,) in place.

        In closed form for point residuals (Horn 1987), otherwise by the solver with a fixed posture.
        """
        options = self.options
        if options.residual != "point":
            fixed = _ONE_POSTURE._replace(mean=pose[ANGLES].copy())
            problem = Problem(self._chain, self._equations, self._points, _FREE, fixed)
            solver = SolverOptions(options.gn_iterations, options.align_damping, options.pose_damping)
            state, progress = SolverState(pose, np.zeros(1), np.zeros(1)), (0.0,) * options.rigid_iterations
            self._solve(problem, solver, state, self._coarse, self._coarse_matches, progress)
            return
        for _ in range(options.rigid_iterations):
            self._match(pose, self._coarse, self._coarse_matches, 0.0)
            found = self._coarse_matches.body >= 0
            if found.sum() >= 3:
                R, t = rigid_alignment(self._coarse_matches.x[found], self._coarse.points[found])
                turned = quaternion_from_matrix(R @ rotation_matrix(pose[ORIENTATION]))
                pose[:] = make_pose(R @ pose[POSITION] + t, turned, pose[ANGLES])
