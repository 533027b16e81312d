"""One particle swarm per frame (Oikonomidis et al. 2011, Sec. 2.4)."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from depthtrack.hand.pose import POSITION, retract
from depthtrack.rendering.scorer import Scorer
from depthtrack.solver.options import SwarmOptions
from depthtrack.solver.swarm import Box, keep_lowest, minimise
from depthtrack.solver.swarm_space import ParameterSpace, SwarmSpace, TangentSpace
from depthtrack.tracking.candidate import Candidate, by_energy
from depthtrack.tracking.frame import FrameContext
from depthtrack.tracking.timing import Deadline
from depthtrack.tracking.visible_centroid import visible_centroid
from depthtrack.types import Array

Spread = tuple[float, float, float]
"""Standard deviations of a first generation: position (m), rotation (rad), angles (rad)."""


def run_swarm(
    scorer: Scorer,
    space: SwarmSpace,
    particles: Array,
    generator: np.random.Generator,
    options: SwarmOptions,
    deadline: Deadline | None = None,
) -> list[Candidate]:
    """Return the best pose of each particle, best first.

    particles: (N, D) in the coordinates of `space`.
    deadline: time after which no generation begins.
    """
    least, agreement = np.full(len(particles), np.inf), np.zeros(len(particles))

    def score(coordinates: Array) -> Array:
        scores = scorer.evaluate(space.poses(coordinates))
        keep_lowest(*scores, least, agreement)
        return scores.energy

    deadline, box = deadline or Deadline(), Box(space.lower, space.upper, space.fingers)
    found = minimise(score, particles, box, generator, options, is_over=lambda: deadline.is_over)
    rows = zip(space.poses(found.positions), found.energies.tolist(), agreement.tolist(), strict=True)
    return by_energy(Candidate(*row) for row in rows)


def swarm_around(
    scorer: Scorer, pose: Array, spread: Spread, options: SwarmOptions, generator: np.random.Generator
) -> Candidate:
    """Return the best pose that a swarm finds around `pose` (27,), which takes part itself."""
    space = TangentSpace(pose)
    particles = generator.standard_normal((options.particles, 26)) * np.repeat(spread, [3, 3, 20])
    particles[0] = 0
    return run_swarm(scorer, space, particles, generator, options)[0]


@dataclass(frozen=True)
class SwarmAround:
    """Refine the best candidate by a swarm around it."""

    options: SwarmOptions
    spread: Spread
    name: str = "swarm"

    def __call__(self, frame: FrameContext, candidates: list[Candidate]) -> list[Candidate]:
        return [swarm_around(frame.tools.scorer, candidates[0].pose, self.spread, self.options, frame.random)]


@dataclass(frozen=True)
class Swarm:
    """Follow the last pose by one swarm.

    space: "parameters" for the 27 raw parameters of the paper, or "tangent" for the 26-dimensional tangent space.
    widen: weight of the hand's motion in the spread of "tangent".

    The first generation of "parameters" surrounds the last pose. That of "tangent" surrounds three poses in equal
    parts: the last pose, its linear prediction, and the last pose moved onto the observed hand.
    """

    options: SwarmOptions
    spread: Spread
    space: Literal["tangent", "parameters"] = "tangent"
    widen: float = 0.0
    name: str = "swarm"

    def __call__(self, frame: FrameContext, candidates: list[Candidate]) -> list[Candidate]:
        last = frame.state.pose
        assert last is not None
        first = self._first_generation_of_paper if self.space == "parameters" else self._first_generation
        make_space: Callable[[Array], SwarmSpace] = ParameterSpace if self.space == "parameters" else TangentSpace
        space = make_space(last)
        particles = space.coordinates(first(frame, last))
        return run_swarm(frame.tools.scorer, space, particles, frame.random, self.options)

    def _first_generation_of_paper(self, frame: FrameContext, last: Array) -> Array:
        """Return perturbations (N, 27) of the last pose."""
        centres = np.tile(last, (self.options.particles, 1))
        return self._perturbed(frame, centres, np.repeat(self.spread, [3, 3, 20]))

    def _first_generation(self, frame: FrameContext, last: Array) -> Array:
        """Return perturbations (N, 27) of the last pose and of two predictions."""
        centres, motion = np.tile(last, (self.options.particles, 1)), frame.motion
        centres[1::3] = retract(last, motion)
        centres[2::3, POSITION] += observed_drift(frame, last)
        return self._perturbed(frame, centres, np.hypot(np.repeat(self.spread, [3, 3, 20]), self.widen * motion))

    def _perturbed(self, frame: FrameContext, centres: Array, spread: Array) -> Array:
        steps = frame.random.standard_normal((len(centres), 26)) * spread
        steps[:3] = 0  # the centres themselves take part
        return retract(centres, steps)


def observed_drift(frame: FrameContext, pose: Array) -> Array:
    """Return the offset (3,), m, of the observed hand from the rendered hand in `pose` (27,)."""
    target = frame.tools.scorer.target
    intrinsics = (target.camera.fx, target.camera.fy, target.camera.cx, target.camera.cy)
    rendered = frame.tools.scorer.render(pose)
    drift = visible_centroid(target.depth, intrinsics) - visible_centroid(rendered, intrinsics)
    return drift if np.isfinite(drift).all() else np.zeros(3)
