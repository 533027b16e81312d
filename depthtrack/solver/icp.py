"""Fits the hand to one observation: matches and damped Gauss-Newton in turn (Schroeder et al. 2014, Sec. IV-C)."""

from dataclasses import dataclass

import numpy as np

from depthtrack.geometry.alignment import rigid_alignment
from depthtrack.geometry.rotations import quaternion_from_matrix, rotation_matrix
from depthtrack.hand.compiled_kinematics import BodyPoses, Chain, forward_kinematics
from depthtrack.hand.pose import ANGLES, ORIENTATION, POSITION, make_pose
from depthtrack.hand.shape import HandShape
from depthtrack.segmentation.observation import Observation
from depthtrack.solver.correspondences import Correspondences, PointCloud, Surface
from depthtrack.solver.gauss_newton import Damping, SolverState, limit_gradient, solve
from depthtrack.solver.normal_equations import NormalEquations, clear
from depthtrack.solver.prior import Prior
from depthtrack.solver.residuals import Residual, add_correspondences
from depthtrack.solver.subspace import FULL, PostureSubspace
from depthtrack.types import Array

_COARSE = 4
"""The whole hand is aligned by every so many-th point of the cloud."""
_STANDARD_COUNT = 3000.0
"""Points that damping is stated for: with more or fewer, it grows and shrinks alongside their sum."""


@dataclass(frozen=True)
class IcpOptions:
    """How an observation is fitted.

    `rounds` of correspondences with at most `inner` Gauss-Newton steps each, after `rigid` rounds that move the hand
    as a whole. `residual` and `kernel_scale` (m, in the first and in the last round, 0 for none) say how
    correspondences
    count, `max_distance` (m) and `min_normal_cosine` (least cosine between normals, in the first and in the last
    round) which do.
    `damping` is lambda of Eq. (4) and `temporal_weight` how firmly the angles are tied to those of the frame before,
    both in
    m^2/rad^2 beside the sum over 3000 points; `synergy_weight` (m^2) how firmly to what synergies call likely: see
    `prior.Prior`.
    """

    rounds: int = 5
    inner: int = 5
    rigid: int = 2
    residual: Residual = "symmetric"
    kernel_scale: tuple[float, float] = (0.03, 0.007)
    max_distance: float = 0.04
    min_normal_cosine: tuple[float, float] = (0.25, 0.6)
    damping: float = 1e-4
    temporal_weight: float = 5e-5
    synergy_weight: float = 3e-7
    avoid_limits: bool = False

    def annealed(self, progress: float) -> tuple[float, float]:
        """Softness and agreement when `progress` (0 to 1) of the rounds is done: outliers lose their say as the fit
        improves."""
        (soft, firm), (low, high) = self.kernel_scale, self.min_normal_cosine
        kernel_scale = soft * (firm / soft) ** progress if soft > 0 and firm > 0 else 0.0
        return float(kernel_scale), low + progress * (high - low)


PAPER_ICP = IcpOptions(
    rigid=1,
    residual="point",
    kernel_scale=(0.0, 0.0),
    min_normal_cosine=(0.0, 0.0),
    damping=1e-6,
    temporal_weight=0.0,
    synergy_weight=0.0,
    avoid_limits=True,
)
"""Schroeder et al. 2014: point to point, all points alike, damping by the step alone, joint limit avoidance."""


class IcpFitter:
    """Fits one hand; holds the working memory."""

    def __init__(self, shape: HandShape, surface: Surface, options: IcpOptions) -> None:
        self.options = options
        self._surface = surface
        self._chain = Chain.of(shape)
        self._bodies, self._moments = BodyPoses.empty(), NormalEquations.empty()

    def set_target(self, observation: Observation, every: int) -> None:
        """Set what the next fits are to: every so many-th point of this observation."""
        self._cloud = PointCloud.of(observation, every)
        self._matches = Correspondences.allocate(len(self._cloud.points))
        self._coarse = PointCloud.of(observation, every * _COARSE)
        self._coarse_matches = Correspondences.allocate(len(self._coarse.points))
        self._surface.set_target(observation, self._cloud, self.options.max_distance)

    def fit(
        self,
        pose: Array,
        space: PostureSubspace = FULL,
        rounds: int | None = None,
        prior: Prior | None = None,
        coarse: bool = False,
        align: bool = True,
    ) -> Array:
        """The pose (27,) reached from `pose` by moving what `space` lets move.

        `coarse` looks at every fourth of the points alone; without `align`, the hand is not moved as a whole before.
        """
        options = self.options
        cloud, correspondences = (self._coarse, self._coarse_matches) if coarse else (self._cloud, self._matches)
        share = len(cloud.points) / _STANDARD_COUNT
        pull = (prior or Prior.none()).scaled(share)
        pose = pose.copy()
        coordinates = space.project(pose[ANGLES])
        pose[ANGLES] = space.angles(coordinates)
        for _ in range(options.rigid if align else 0):
            self._align(pose)
        slope = np.array([limit_gradient(*c) for c in zip(coordinates, space.lower, space.upper, strict=True)])
        state = SolverState(pose, coordinates, slope)
        damping = Damping(options.damping * share, 1e-9, pull.precision, pull.mean, options.avoid_limits)
        rounds = options.rounds if rounds is None else rounds
        for k in range(rounds):
            self._match(pose, cloud, correspondences, k / max(rounds - 1, 1))
            solve(self._chain, self._moments, space, damping, options.inner, self._bodies, state)
        return pose

    def _match(self, pose: Array, cloud: PointCloud, correspondences: Correspondences, progress: float) -> None:
        kernel_scale, min_normal_cosine = self.options.annealed(progress)
        forward_kinematics(self._chain, pose, self._bodies)
        self._surface.match(pose, self._bodies, cloud, min_normal_cosine, correspondences)
        clear(self._moments, self._bodies)
        add_correspondences(self._moments, correspondences, cloud, self.options.residual, kernel_scale)

    def _align(self, pose: Array) -> None:
        """Move the whole hand onto its correspondences: in closed form for points (Horn 1987), else by solving."""
        correspondences = self._coarse_matches
        self._match(pose, self._coarse, correspondences, 0.0)
        if self.options.residual != "point":
            still = SolverState(pose, np.zeros(1), np.zeros(1))
            towards = PostureSubspace(np.zeros((20, 1)), pose[ANGLES].copy(), np.array([-1.0]), np.array([1.0]), False)
            free = Damping(1.0, 1e-9, np.zeros((20, 20)), np.zeros(20), False)
            solve(self._chain, self._moments, towards, free, self.options.inner, self._bodies, still)
            return
        found = correspondences.body >= 0
        if found.sum() >= 3:
            R, t = rigid_alignment(correspondences.x[found], self._coarse.points[found])
            turned = quaternion_from_matrix(R @ rotation_matrix(pose[ORIENTATION]))
            pose[:] = make_pose(R @ pose[POSITION] + t, turned, pose[ANGLES])
