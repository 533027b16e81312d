"""Fits the hand to one observation: matches and damped Gauss-Newton in turn (Schroeder et al. 2014, Sec. IV-C)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthtrack.geometry.alignment import rigid_alignment
from depthtrack.hand.compiled_kinematics import Bodies, Chain, place
from depthtrack.hand.pose import ANGLES, ORIENTATION, POSITION, make_pose, quaternion_from_matrix, rotation_matrix
from depthtrack.hand.shape import HandShape
from depthtrack.segmentation.observation import Observation
from depthtrack.solver.correspondences import Cloud, Matches, Surface
from depthtrack.solver.gauss_newton import Damping, Solution, limit_slope, solve
from depthtrack.solver.normal_equations import Moments, clear
from depthtrack.solver.prior import Prior
from depthtrack.solver.residuals import Residual, add_matches
from depthtrack.solver.subspace import FULL, Space

Array = NDArray[np.float64]

_COARSE = 4
"""The whole hand is aligned by every so many-th point of the cloud."""
_STANDARD_COUNT = 3000.0
"""Points that damping is stated for: with more or fewer, it grows and shrinks alongside their sum."""


@dataclass(frozen=True)
class FitOptions:
    """How an observation is fitted.

    `rounds` of correspondences with at most `inner` Gauss-Newton steps each, after `rigid` rounds that move the hand
    as a whole. `residual` and `softness` (m, in the first and in the last round, 0 for none) say how correspondences
    count, `reach` (m) and `agreement` (least cosine between normals, in the first and in the last round) which do.
    `damping` is lambda of Eq. (4) and `hold` how firmly the angles are tied to those of the frame before, both in
    m^2/rad^2 beside the sum over 3000 points; `likely` (m^2) how firmly to what synergies call likely: see
    `prior.Prior`.
    """

    rounds: int = 5
    inner: int = 5
    rigid: int = 2
    residual: Residual = "symmetric"
    softness: tuple[float, float] = (0.03, 0.007)
    reach: float = 0.04
    agreement: tuple[float, float] = (0.25, 0.6)
    damping: float = 1e-4
    hold: float = 5e-5
    likely: float = 3e-7
    avoid_limits: bool = False

    def strictness(self, progress: float) -> tuple[float, float]:
        """Softness and agreement when `progress` (0 to 1) of the rounds is done: outliers lose their say as the fit
        improves."""
        (soft, firm), (low, high) = self.softness, self.agreement
        softness = soft * (firm / soft) ** progress if soft > 0 and firm > 0 else 0.0
        return float(softness), low + progress * (high - low)


PAPER_FIT = FitOptions(
    rigid=1,
    residual="point",
    softness=(0.0, 0.0),
    agreement=(0.0, 0.0),
    damping=1e-6,
    hold=0.0,
    likely=0.0,
    avoid_limits=True,
)
"""Schroeder et al. 2014: point to point, all points alike, damping by the step alone, joint limit avoidance."""


class Fitter:
    """Fits one hand; holds the working memory."""

    def __init__(self, shape: HandShape, surface: Surface, options: FitOptions) -> None:
        self.options = options
        self._surface = surface
        self._chain = Chain.of(shape)
        self._bodies, self._moments = Bodies.empty(), Moments.empty()

    def observe(self, observation: Observation, every: int) -> None:
        """Set what the next fits are to: every so many-th point of this observation."""
        self._cloud = Cloud.of(observation, every)
        self._matches = Matches.room(len(self._cloud.points))
        self._coarse = Cloud.of(observation, every * _COARSE)
        self._coarse_matches = Matches.room(len(self._coarse.points))
        self._surface.observe(observation, self._cloud, self.options.reach)

    def fit(
        self,
        pose: Array,
        space: Space = FULL,
        rounds: int | None = None,
        prior: Prior | None = None,
        coarse: bool = False,
        align: bool = True,
    ) -> Array:
        """The pose (27,) reached from `pose` by moving what `space` lets move.

        `coarse` looks at every fourth of the points alone; without `align`, the hand is not moved as a whole before.
        """
        options = self.options
        cloud, matches = (self._coarse, self._coarse_matches) if coarse else (self._cloud, self._matches)
        share = len(cloud.points) / _STANDARD_COUNT
        pull = (prior or Prior.none()).scaled(share)
        pose = pose.copy()
        coordinates = space.project(pose[ANGLES])
        pose[ANGLES] = space.angles(coordinates)
        for _ in range(options.rigid if align else 0):
            self._align(pose)
        slope = np.array([limit_slope(*c) for c in zip(coordinates, space.lower, space.upper, strict=True)])
        state = Solution(pose, coordinates, slope)
        damping = Damping(options.damping * share, 1e-9, pull.precision, pull.rest, options.avoid_limits)
        rounds = options.rounds if rounds is None else rounds
        for k in range(rounds):
            self._match(pose, cloud, matches, k / max(rounds - 1, 1))
            solve(self._chain, self._moments, space, damping, options.inner, self._bodies, state)
        return pose

    def _match(self, pose: Array, cloud: Cloud, matches: Matches, progress: float) -> None:
        softness, agreement = self.options.strictness(progress)
        place(self._chain, pose, self._bodies)
        self._surface.match(pose, self._bodies, cloud, agreement, matches)
        clear(self._moments, self._bodies)
        add_matches(self._moments, matches, cloud, self.options.residual, softness)

    def _align(self, pose: Array) -> None:
        """Move the whole hand onto its correspondences: in closed form for points (Horn 1987), else by solving."""
        matches = self._coarse_matches
        self._match(pose, self._coarse, matches, 0.0)
        if self.options.residual != "point":
            still = Solution(pose, np.zeros(1), np.zeros(1))
            held = Space(np.zeros((20, 1)), pose[ANGLES].copy(), np.array([-1.0]), np.array([1.0]), False)
            free = Damping(1.0, 1e-9, np.zeros((20, 20)), np.zeros(20), False)
            solve(self._chain, self._moments, held, free, self.options.inner, self._bodies, still)
            return
        found = matches.body >= 0
        if found.sum() >= 3:
            R, t = rigid_alignment(matches.x[found], self._coarse.points[found])
            turned = quaternion_from_matrix(R @ rotation_matrix(pose[ORIENTATION]))
            pose[:] = make_pose(R @ pose[POSITION] + t, turned, pose[ANGLES])
