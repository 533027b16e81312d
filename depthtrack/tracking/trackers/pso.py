"""The PSO tracker: one swarm a frame, around the last pose and where it was heading (Oikonomidis 2011, Sec. 2.4)."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from depthtrack.errors import InputError
from depthtrack.hand.pose import ANGLES, POSITION, retract
from depthtrack.hand.shape import HandShape
from depthtrack.recording.status import Status
from depthtrack.rendering.backends import create_scorer
from depthtrack.rendering.objective import Objective
from depthtrack.segmentation.observation import Observation
from depthtrack.solver.icp import IcpFitter, IcpOptions
from depthtrack.solver.prior import Prior
from depthtrack.solver.subspace import FULL
from depthtrack.solver.swarm import SwarmOptions, constriction, minimise
from depthtrack.solver.swarm_space import ParameterSpace, SwarmSpace, TangentSpace
from depthtrack.tracking.random import checked_pose, frame_generator
from depthtrack.tracking.stages.swarm_recovery import Recovery, RecoveryOptions
from depthtrack.tracking.stages.swarm_search import Polish, SearchOptions, find_pose, refine
from depthtrack.tracking.state import TrackingThresholds, TrackState
from depthtrack.tracking.surfaces.registry import make_surface
from depthtrack.tracking.timing import StageClock
from depthtrack.tracking.tracker import Estimate
from depthtrack.tracking.visible_centroid import visible_centroid
from depthtrack.types import Array

Variant = Literal["default", "paper"]
Finish = Literal["none", "skin"]

_POLISH_EVERY, _POLISH_ROUNDS = 6, 8
"""Every so many-th point is used where a search polishes its poses, and so many rounds."""
_FINISH_EVERY = 3
"""Every so many-th point is used where a frame's pose is drawn to the skin."""


@dataclass(frozen=True)
class PsoOptions:
    """How the PSO tracker works; the same options and observations give the same bits on any number of threads.

    `variant` "paper" is Oikonomidis et al. 2011: 27 raw parameters, the swarm around the last solution, w of Eq. (3),
    fingers randomised over their whole range. "default" flies in the tangent space; a third of the swarm each starts
    around the last pose, its linear prediction, and the last pose moved onto the observed hand, the wider the faster
    the hand; it damps more and randomises half of the fingers near the best. Each was measured to help.
    `resolution` is the longest side, in pixels, of the region hypotheses are rendered at; None keeps the sensor's.
    "default" also thinks again about poses that explain little: see `second_thoughts.RecoveryOptions`.
    The searches of "default" fit surfaces between their rounds, as the IK tracker does.
    With `finish` "skin", the swarm's best pose is at last drawn to the observed points by the hand's skin, whose palm
    is no cylinder; "none" is the paper's way.
    `spread` is the standard deviation of the first generation: metres, radians of rotation, radians of the angles.
    """

    variant: Variant = "default"
    particles: int = 64
    generations: int = 25
    seed: int = 0
    renderer: str = "raster"
    threads: int = 1
    resolution: int | None = None
    spread: tuple[float, float, float] = (0.004, 0.04, 0.04)
    finish: Finish = "none"
    recovery: RecoveryOptions = field(default_factory=RecoveryOptions)
    lost: TrackingThresholds = field(default_factory=TrackingThresholds)
    objective: Objective = field(default_factory=Objective)
    search: SearchOptions = field(default_factory=SearchOptions)

    @property
    def swarm(self) -> SwarmOptions:
        """The swarm of each frame."""
        if self.variant == "paper":
            return SwarmOptions(self.particles, self.generations, inertia=constriction(2.8, 1.3))
        return SwarmOptions(self.particles, self.generations, inertia=0.6, near_best=0.5)


class PsoTracker:
    """Follows a hand by rendering hypotheses: see `tracker.Tracker`."""

    name = "pso"
    stages: tuple[str, ...] = ("observe", "swarm")

    def __init__(self, shape: HandShape, options: PsoOptions | None = None) -> None:
        self.options = options = options or PsoOptions()
        if options.variant not in ("default", "paper"):
            raise InputError(f"no PSO variant '{options.variant}': choose default or paper")
        if options.finish not in ("none", "skin"):
            raise InputError(f"no way '{options.finish}' to finish a pose: choose none or skin")
        threads = {"threads": options.threads} if options.renderer == "raster" else {}
        self._scorer = create_scorer(options.renderer, shape, options.objective, **threads)
        self._recovery = Recovery(shape, self._scorer, options.search, options.recovery)
        self._shape = shape
        self._fitter: IcpFitter | None = None
        if options.finish == "skin":
            self._skin_fitter()
        self._state = TrackState(options.lost)

    def start(self, observation: Observation, pose: ArrayLike | None = None) -> Estimate:
        """Begin on this frame, from a pose (27,) refined by a swarm, or by searching."""
        clock = StageClock(self.stages)
        self._observe(observation)
        clock.lap("observe")
        generator = frame_generator(self.options.seed, observation.frame_index)
        if pose is None:
            found, energy = self._search(observation, generator)
        else:
            found, energy = refine(self._scorer, checked_pose(pose), self.options.spread, self.options.swarm, generator)
        found, energy = self._finish(observation, found, energy)
        return self._settle(found, energy, Status.STARTED, clock)

    def track(self, observation: Observation) -> Estimate:
        """Follow the hand into the next frame; searches where the track was lost or there is none."""
        last = self._state.pose
        clock = StageClock(self.stages)
        self._observe(observation)
        clock.lap("observe")
        options, generator = self.options, frame_generator(self.options.seed, observation.frame_index)
        if last is None:
            found = self._reinitialise_near_last(observation, generator, *self._search(observation, generator))
            return self._settle(*self._finish(observation, *found), Status.STARTED, clock)
        space = self._space(last)
        best = minimise(
            lambda x: self._scorer.score(space.poses(x)),
            self._population(space, last, generator),
            space.lower,
            space.upper,
            space.fingers,
            generator,
            options.swarm,
        )
        pose, energy = space.poses(best.position[None])[0], best.energy
        pose, energy = self._refine_locally(observation, generator, pose, energy)
        pose, energy = self._refine_per_finger(observation, generator, pose, energy)
        pose, energy = self._finish(observation, pose, energy)
        return self._settle(pose, energy, Status.TRACKED, clock)

    def restore(self, estimates: Sequence[Estimate]) -> None:
        """Take up a track after these estimates, as if they had been made just now."""
        for estimate in estimates:
            self._state.update(estimate)

    @property
    def predicted_pose(self) -> Array | None:
        """The linear prediction, while the track is sure."""
        return self._state.predicted_pose

    def close(self) -> None:
        self._scorer.close()

    def _observe(self, observation: Observation) -> None:
        resolution = self.options.resolution
        self._scorer.set_target(observation if resolution is None else observation.reduced(resolution))

    def _space(self, reference: Array) -> SwarmSpace:
        return ParameterSpace(reference) if self.options.variant == "paper" else TangentSpace(reference)

    def _population(self, space: SwarmSpace, last: Array, generator: np.random.Generator) -> Array:
        """The first generation: perturbations of the last pose and, by default, of where the hand may have gone."""
        count = self.options.particles
        centres, spread = np.tile(last, (count, 1)), np.repeat(self.options.spread, [3, 3, 20])
        if self.options.variant == "default":
            centres[1::3] = retract(last, self._state.velocity)
            centres[2::3, POSITION] += self._drift(last)
            # What moved fast may as well have stopped, or turned: look as far as half of its last step.
            spread = np.hypot(spread, 0.5 * self._state.velocity)
        steps = generator.standard_normal((count, 26)) * spread
        steps[:3] = 0  # the centres themselves take part
        return space.coordinates(retract(centres, steps))

    def _drift(self, last: Array) -> Array:
        """How far (3, metres) the observed hand lies from the last pose, as seen through the same camera."""
        camera = self._scorer.target.camera
        intrinsics = (camera.fx, camera.fy, camera.cx, camera.cy)
        seen, predicted_pose = (
            visible_centroid(depth, intrinsics) for depth in (self._scorer.target.depth, self._scorer.render(last))
        )
        return seen - predicted_pose if np.isfinite(seen + predicted_pose).all() else np.zeros(3)

    def _refine_locally(
        self, observation: Observation, generator: np.random.Generator, pose: Array, energy: float
    ) -> tuple[Array, float]:
        """The pose and its energy, or what is found close by: asked now and then where the pose explains little, and
        at once in doubt."""
        options = self.options.recovery
        if self.options.variant != "default" or energy <= self.options.search.good_energy:
            return pose, energy
        confidence = float(self._scorer.terms(pose[None]).agreement[0])
        doubted = self._state.is_lost(energy, confidence, options.doubted)
        if not doubted and (options.every == 0 or observation.frame_index % options.every != 0):
            return pose, energy
        other, lower = self._recovery.search_locally(pose, generator, self._polish(observation))
        return (other, lower) if lower < (1 if doubted else options.accept_local) * energy else (pose, energy)

    def _refine_per_finger(
        self, observation: Observation, generator: np.random.Generator, pose: Array, energy: float
    ) -> tuple[Array, float]:
        """The pose and its energy, or one with single fingers elsewhere: asked where it explains little."""
        options = self.options
        if options.variant != "default" or energy <= options.search.good_energy or options.recovery.accept_finger == 0:
            return pose, energy
        return self._recovery.refine_per_finger(pose, energy, generator, self._polish(observation))

    def _reinitialise_near_last(
        self, observation: Observation, generator: np.random.Generator, accept_global: Array, energy: float
    ) -> tuple[Array, float]:
        """Of a hand that was lost a moment ago: it has hardly turned since, unless `accept_global` explains much
        more."""
        last_trusted = self._state.last_trusted
        if last_trusted is None or self.options.variant == "paper":
            return accept_global, energy
        here = last_trusted.copy()
        here[POSITION] = observation.centre
        near = self._recovery.search_locally(here, generator, self._polish(observation))
        near = self._refine_per_finger(observation, generator, *near)
        return (accept_global, energy) if energy < self.options.recovery.accept_global * near[1] else near

    def _search(self, observation: Observation, generator: np.random.Generator) -> tuple[Array, float]:
        """A pose and its energy from the observation alone."""
        options, centre = self.options.search, observation.centre
        if self.options.variant == "paper":
            return find_pose(self._scorer, centre, generator, options)
        polish, arm = self._polish(observation), observation.arm_direction
        found, energy = find_pose(self._scorer, centre, generator, options, polish, arm)
        return self._refine_per_finger(observation, generator, found, energy)

    def _polish(self, observation: Observation) -> Polish | None:
        """The skin drawn to the observed surface; None for sizes that no skin fits."""
        try:
            fitter = self._skin_fitter()
        except InputError:
            return None
        fitter.set_target(observation, _POLISH_EVERY)
        return lambda pose: fitter.fit(pose, FULL, _POLISH_ROUNDS)

    def _finish(self, observation: Observation, pose: Array, energy: float) -> tuple[Array, float]:
        """The pose drawn to the skin, its fingers held to what the swarm says, and its energy; as it is for `none`."""
        if self.options.finish == "none":
            return pose, energy
        fitter = self._skin_fitter()
        fitter.set_target(observation, _FINISH_EVERY)
        drawn = fitter.fit(pose, FULL, prior=Prior.towards(pose[ANGLES], fitter.options.temporal_weight))
        return drawn, float(self._scorer.score(drawn[None])[0])

    def _skin_fitter(self) -> IcpFitter:
        if self._fitter is None:
            self._fitter = IcpFitter(self._shape, make_surface("skin", self._shape), IcpOptions())
        return self._fitter

    def _settle(self, pose: Array, energy: float, status: Status, clock: StageClock) -> Estimate:
        confidence = float(self._scorer.terms(pose[None]).agreement[0])
        clock.lap("swarm")
        return self._state.commit(pose, energy, confidence, status, clock.milliseconds)
