"""The IK tracker: the hand's surface drawn to the observed one, from where it was heading (Schroeder et al. 2014)."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from depthtrack.errors import InputError
from depthtrack.hand.limits import within_limits
from depthtrack.hand.pose import ANGLES, POSITION, retract
from depthtrack.hand.shape import HandShape
from depthtrack.hand.synergies import Synergies, load_synergies
from depthtrack.recording.status import Status
from depthtrack.rendering.objective import Objective
from depthtrack.rendering.raster import RasterScorer
from depthtrack.segmentation.observation import Observation
from depthtrack.solver.icp import PAPER_ICP, IcpFitter, IcpOptions
from depthtrack.solver.prior import Prior
from depthtrack.solver.residuals import Residual
from depthtrack.solver.subspace import FULL, PostureSubspace
from depthtrack.tracking.random import checked_pose, frame_generator
from depthtrack.tracking.stages.coarse_to_fine import sort_by_energy
from depthtrack.tracking.stages.fit_recovery import Recovery, RecoveryOptions
from depthtrack.tracking.stages.fit_search import SearchOptions, find_pose
from depthtrack.tracking.state import TrackingThresholds, TrackState
from depthtrack.tracking.surfaces.registry import Model, make_surface
from depthtrack.tracking.timing import StageClock
from depthtrack.tracking.tracker import Estimate
from depthtrack.types import Array

Variant = Literal["default", "paper"]


@dataclass(frozen=True)
class IkOptions:
    """How the IK tracker works; the same options and observations give the same bits.

    `variant` "paper" is Schroeder et al. 2014: point to point, linear prediction, joint limit avoidance. "default" fits
    along normals with graduated robust weights, chooses among predictions by rendering them, and tries again where the
    result does not look like the observation: each measured to help. `fit` overrides either's way of fitting, and
    `residual` its residual. `model` is what the observation is matched to: the skin mesh, or tapered capsules. Every
    `subsample`-th point is used.

    With `synergies` (as such, or the name of a set or a file), of which the first `components` count, only they and the
    global pose are solved for: the paper's reduced degrees of freedom. If `soft`, all angles are, drawn to postures
    that are likely by the synergies: see `prior.Prior.synergy_weight`. The search for a start, which needs synergies
    in any case, then uses them too.
    """

    variant: Variant = "default"
    model: Model = "skin"
    rounds: int = 5
    inner: int = 5
    subsample: int = 3
    residual: Residual | None = None
    synergies: Synergies | str | None = None
    components: int | None = None
    soft: bool = False
    seed: int = 0
    recovery: RecoveryOptions = field(default_factory=RecoveryOptions)
    lost: TrackingThresholds = field(default_factory=TrackingThresholds)
    fit: IcpOptions | None = None
    search: SearchOptions = field(default_factory=SearchOptions)
    objective: Objective = field(default_factory=Objective)

    @property
    def fitting(self) -> IcpOptions:
        """How each observation is fitted."""
        base = self.fit or (PAPER_ICP if self.variant == "paper" else IcpOptions())
        return replace(
            base, icp_iterations=self.rounds, gn_iterations=self.inner, residual=self.residual or base.residual
        )

    @property
    def chosen_synergies(self) -> Synergies | None:
        """Those to solve for, or to be drawn to. Raises InputError for a file that is none."""
        if self.synergies is None:
            return None
        found = load_synergies(self.synergies) if isinstance(self.synergies, str) else self.synergies
        return found if self.components is None else found.truncated(self.components)

    @property
    def predictions(self) -> tuple[float, ...]:
        """Shares of the last frame's motion that the next frame's may be."""
        return (1.0,) if self.variant == "paper" else (0.0, 0.5, 1.0)


class IkTracker:
    """Follows a hand by fitting its surface: see `tracker.Tracker`."""

    name = "ik"
    stages: tuple[str, ...] = ("observe", "predict", "fit", "retry")

    def __init__(self, shape: HandShape, options: IkOptions | None = None) -> None:
        self.options = options = options or IkOptions()
        if options.variant not in ("default", "paper"):
            raise InputError(f"no IK variant '{options.variant}': choose default or paper")
        for name in ("rounds", "inner", "subsample"):
            if not 1 <= getattr(options, name) <= 1000:
                raise InputError(f"{name} must lie between 1 and 1000, found {getattr(options, name)}")
        if options.residual not in (None, *get_args(Residual)):
            raise InputError(f"no residual '{options.residual}': choose {', '.join(get_args(Residual))}")
        fitting = options.fitting
        self._fitter = IcpFitter(shape, make_surface(options.model, shape), fitting)
        self._scorer = RasterScorer(shape, options.objective)
        given = options.chosen_synergies
        for name in ("components", "soft"):
            if getattr(options, name) and given is None:
                raise InputError(f"{name} tells how to use synergies: say which synergies")
        self._space: PostureSubspace = FULL if given is None or options.soft else PostureSubspace.of(given)
        self._likely = None if given is None else Prior.synergy_weight(given, fitting.synergy_weight)
        self._synergies = given or load_synergies()
        self._recovery = Recovery(
            shape, self._fitter, self._scorer, self._synergies, options.recovery, options.objective
        )
        self._state = TrackState(options.lost)

    def start(self, observation: Observation, pose: ArrayLike | None = None) -> Estimate:
        """Begin on this frame, from a pose (27,) refined by fitting, or by searching."""
        clock = StageClock(self.stages)
        self._observe(observation)
        clock.lap("observe")
        if pose is None:
            found = self._search(observation)
            clock.lap("retry")
        else:
            found = self._fitter.fit(
                within_limits(checked_pose(pose)), self._space, 2 * self.options.rounds, self._likely
            )
            clock.lap("fit")
        return self._settle(found, Status.STARTED, clock)

    def track(self, observation: Observation) -> Estimate:
        """Follow the hand into the next frame; searches where the track was lost or there is none."""
        last = self._state.pose
        clock = StageClock(self.stages)
        self._observe(observation)
        clock.lap("observe")
        if last is None:
            found = self._reinitialise_near_last(observation, self._search(observation))
            clock.lap("retry")
            return self._settle(found, Status.STARTED, clock)
        steps = np.outer(self.options.predictions, self._state.velocity)
        ahead = within_limits(retract(last, steps))
        ahead = ahead[np.argsort(self._scorer.score(ahead), kind="stable")]
        clock.lap("predict")
        prior = self._likely or Prior.towards(last[ANGLES], self._fitter.options.temporal_weight)
        # In a few synergies, the steps themselves align the hand as well; nor does their energy tell when to try again.
        careful = self._space.full or self.options.variant == "paper"
        found = self._fitter.fit(ahead[0], self._space, prior=prior, align=careful)
        clock.lap("fit")
        if self._space.full and self.options.variant == "default":
            found, status = self._refine_locally(observation, self._try_other_predictions(found, ahead[1:], prior))
            if status is Status.TRACKED:
                found = self._refine_per_finger(observation, found)
            clock.lap("retry")
            return self._settle(found, status, clock)
        return self._settle(found, Status.TRACKED, clock)

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
        self._recovery.close()

    def _observe(self, observation: Observation) -> None:
        self._scorer.set_target(observation)
        self._fitter.set_target(observation, self.options.subsample)

    def _try_other_predictions(self, found: Array, others: Array, prior: Prior) -> Array:
        """The best of what further descents find, where the first one ended much higher than the frame before."""
        satisfied = 1.3 * self._state.energy + 2.0
        if self._scorer.score(found[None])[0] <= satisfied:
            return found
        tried = np.stack([found, *(self._fitter.fit(pose, self._space, prior=prior) for pose in others)])
        energies = self._scorer.score(tried)
        best = tried[np.argmin(energies)]
        if energies.min() <= satisfied:
            return best
        further = self._fitter.fit(best, self._space, 2 * self.options.rounds, prior)
        return sort_by_energy(self._scorer, np.stack([best, further]))[0][0]

    def _refine_locally(self, observation: Observation, pose: Array) -> tuple[Array, Status]:
        """The better of a pose and what is found close by: asked now and then where the pose explains little. Where the
        track would be lost, it is asked at once, and elsewhere too, which has to explain much more."""
        options, terms = self.options.recovery, self._scorer.terms(pose[None])
        energy, confidence = float(terms.energy[0]), float(terms.agreement[0])
        due = options.every > 0 and observation.frame_index % options.every == 0
        lost = self._state.is_lost(energy, confidence)
        if energy <= self.options.search.good_energy or not (due or lost):
            return pose, Status.TRACKED
        other, lower = self._recovery.search_locally(pose, self._generator(observation))
        if lower < (1 if lost else options.accept_local) * energy:
            pose, energy = other, lower
        if lost:
            accept_global = self._search(observation)
            if self._scorer.score(accept_global[None])[0] < options.accept_global * energy:
                return accept_global, Status.STARTED
        return pose, Status.TRACKED

    def _refine_per_finger(self, observation: Observation, pose: Array) -> Array:
        """The pose, or one with single fingers elsewhere: asked where it explains little."""
        energy = float(self._scorer.score(pose[None])[0])
        good = energy <= self.options.search.good_energy
        if good or self.options.recovery.accept_finger == 0 or self._likely is not None:
            return pose
        return self._recovery.refine_per_finger(pose, energy, self._generator(observation))[0]

    def _reinitialise_near_last(self, observation: Observation, accept_global: Array) -> Array:
        """Of a hand that was lost a moment ago: it has hardly turned since, unless `accept_global` explains much
        more."""
        last_trusted = self._state.last_trusted
        if last_trusted is None or self._likely is not None or self.options.variant == "paper":
            return accept_global
        here = last_trusted.copy()
        here[POSITION] = observation.centre
        near = self._recovery.search_locally(here, self._generator(observation))[0]
        near = self._refine_per_finger(observation, near)
        energies = self._scorer.score(np.stack([near, accept_global]))
        return accept_global if energies[1] < self.options.recovery.accept_global * energies[0] else near

    def _search(self, observation: Observation) -> Array:
        options, default = self.options, self.options.variant == "default"
        arm, generator = observation.arm_direction if default else None, self._generator(observation)
        found = find_pose(
            self._fitter, self._scorer, observation.centre, self._synergies, options.search, generator, arm
        )[0]
        if options.synergies is not None:
            return self._fitter.fit(found, self._space, prior=self._likely)
        return self._refine_per_finger(observation, found) if default else found

    def _generator(self, observation: Observation) -> np.random.Generator:
        return frame_generator(self.options.seed, observation.frame_index)

    def _settle(self, pose: Array, status: Status, clock: StageClock) -> Estimate:
        terms = self._scorer.terms(pose[None])
        energy, confidence = float(terms.energy[0]), float(terms.agreement[0])
        return self._state.commit(pose, energy, confidence, status, clock.milliseconds)
