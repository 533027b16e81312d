"""Fits the hand to one observation: matches and damped Gauss-Newton in turn (Schroeder et al. 2014, Sec. IV-C)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthtrack.hand.alignment import rigid_alignment
from depthtrack.hand.pose import ANGLES, ORIENTATION, POSITION, make_pose, quaternion_from_matrix, rotation_matrix
from depthtrack.hand.shape import HandShape
from depthtrack.hand.synergies import Synergies
from depthtrack.observation.observation import Observation
from depthtrack.tracking.ik.chain import Bodies, Chain, place
from depthtrack.tracking.ik.matching import Cloud, Surface
from depthtrack.tracking.ik.moments import Moments, clear
from depthtrack.tracking.ik.residuals import Residual, add_matches
from depthtrack.tracking.ik.solver import Damping, Solution, limit_slope, solve
from depthtrack.tracking.ik.space import FULL, Space

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FitOptions:
    """How an observation is fitted.

    `rounds` of correspondences with at most `inner` Gauss-Newton steps each, after `rigid` rounds that move the hand
    as a whole. `damping` lambda of Eq. (4), m^2/rad^2 for a sum over all points; `reach` (m) and `agreement` (cosine of
    the normals) that correspondences must have; `softness` (m) of the robust weights, 0 for none.
    """

    rounds: int = 5
    inner: int = 5
    rigid: int = 1
    residual: Residual = "symmetric"
    softness: float = 0.01
    reach: float = 0.03
    agreement: float = 0.3
    damping: float = 1e-4
    avoid_limits: bool = False


class Fitter:
    """Fits one hand; holds the working memory."""

    def __init__(self, shape: HandShape, surface: Surface, options: FitOptions) -> None:
        self.options = options
        self._surface = surface
        self._chain = Chain.of(shape)
        self._bodies, self._moments = Bodies.empty(), Moments.empty()
        none = np.zeros((20, 20)), np.zeros(20)
        self._damping = Damping(options.damping, 1e-9, *none, options.avoid_limits)

    def observe(self, observation: Observation, every: int) -> None:
        """Set what the next fits are to, every so many-th point of it."""
        self._cloud = Cloud.of(observation, every)
        self._surface.observe(observation, self._cloud, self.options.reach)

    def fit(self, pose: Array, space: Space = FULL, rounds: int | None = None) -> Array:
        """The pose (27,) reached from `pose` by moving what `space` lets move."""
        pose = pose.copy()
        coordinates = space.project(pose[ANGLES])
        pose[ANGLES] = space.angles(coordinates)
        for _ in range(self.options.rigid):
            self._align(pose)
        slope = np.array([limit_slope(*c) for c in zip(coordinates, space.lower, space.upper, strict=True)])
        state = Solution(pose, coordinates, slope)
        for _ in range(self.options.rounds if rounds is None else rounds):
            self._match(pose)
            solve(self._chain, self._moments, space, self._damping, self.options.inner, self._bodies, state)
        return pose

    def _match(self, pose: Array) -> None:
        place(self._chain, pose, self._bodies)
        matches = self._surface.match(pose, self._bodies)
        clear(self._moments, self._bodies)
        add_matches(self._moments, matches, self._cloud, self.options.residual, self.options.softness)

    def _align(self, pose: Array) -> None:
        """Move the whole hand onto its correspondences: in closed form for points (Horn 1987), else by solving."""
        if self.options.residual != "point":
            self._match(pose)
            held = Space(np.zeros((20, 1)), pose[ANGLES].copy(), np.array([-1.0]), np.array([1.0]), False)
            still = Solution(pose, np.zeros(1), np.zeros(1))
            solve(self._chain, self._moments, held, self._damping, self.options.inner, self._bodies, still)
            return
        place(self._chain, pose, self._bodies)
        matches = self._surface.match(pose, self._bodies)
        found = matches.body >= 0
        if found.sum() >= 3:
            R, t = rigid_alignment(matches.x[found], self._cloud.points[found])
            turned = quaternion_from_matrix(R @ rotation_matrix(pose[ORIENTATION]))
            pose[:] = make_pose(R @ pose[POSITION] + t, turned, pose[ANGLES])


def synergy_space(synergies: Synergies) -> Space:
    """The space of these synergies."""
    return Space(synergies.components, synergies.mean, synergies.lower, synergies.upper, False)
