"""The IK tracker: the hand's surface drawn to the observed one, from where it was heading (Schroeder et al. 2014)."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from depthtrack.errors import InputError
from depthtrack.hand.limits import within_limits
from depthtrack.hand.pose import POSE_SIZE, retract
from depthtrack.hand.shape import HandShape
from depthtrack.hand.synergies import Synergies
from depthtrack.observation.observation import Observation
from depthtrack.rendering.raster import RasterScorer
from depthtrack.rendering.target import Target
from depthtrack.tracking.ik.capsules import CapsuleSurface
from depthtrack.tracking.ik.fit import FitOptions, Fitter, synergy_space
from depthtrack.tracking.ik.matching import Surface
from depthtrack.tracking.ik.mesh import MeshSurface
from depthtrack.tracking.ik.space import FULL, Space
from depthtrack.tracking.memory import LostBelow, TrackMemory
from depthtrack.tracking.pso.search import SearchOptions, find_pose
from depthtrack.tracking.tracker import Estimate, Status

Array = NDArray[np.float64]
Variant = Literal["default", "paper"]
Model = Literal["skin", "cylinders"]

PAPER = FitOptions(residual="point", softness=0.0, agreement=0.0, avoid_limits=True)
"""Schroeder et al. 2014: point to point, no robust weights, joint limit avoidance."""


@dataclass(frozen=True)
class IkOptions:
    """How the IK tracker works; the same options and observations give the same bits.

    `variant` "paper" is Schroeder et al. 2014, "default" what was measured to do best. `model` is what the observation
    is matched to: the skin mesh, or the model of cylinders and spheres. Every `subsample`-th point is used. With
    `synergies`, only they and the global pose are solved for. `fit` overrides everything about the fit.
    """

    variant: Variant = "default"
    model: Model = "skin"
    rounds: int = 5
    inner: int = 5
    subsample: int = 3
    synergies: Synergies | None = None
    seed: int = 0
    lost: LostBelow = field(default_factory=LostBelow)
    search: SearchOptions = field(default_factory=SearchOptions)
    fit: FitOptions | None = None

    @property
    def fitting(self) -> FitOptions:
        """How each observation is fitted."""
        base = self.fit or (PAPER if self.variant == "paper" else FitOptions())
        return base if self.fit else replace(base, rounds=self.rounds, inner=self.inner)


def make_surface(model: Model, shape: HandShape, agreement: float) -> Surface:
    """The surface of a hand that observations are matched to. Raises InputError for another name."""
    if model == "skin":
        return MeshSurface(shape, agreement)
    if model == "cylinders":
        return CapsuleSurface(shape, agreement)
    raise InputError(f"no hand model '{model}': choose skin or cylinders")


class IkTracker:
    """Follows a hand by fitting its surface: see `tracker.Tracker`."""

    name = "ik"
    stages: tuple[str, ...] = ("observe", "fit", "check")

    def __init__(self, shape: HandShape, options: IkOptions | None = None) -> None:
        self.options = options = options or IkOptions()
        if options.variant not in ("default", "paper"):
            raise InputError(f"no IK variant '{options.variant}': choose default or paper")
        if options.subsample < 1:
            raise InputError(f"subsample must be 1 or more, found {options.subsample}")
        fit = options.fitting
        self._fitter = Fitter(shape, make_surface(options.model, shape, fit.agreement), fit)
        self._scorer = RasterScorer(shape)
        self._space: Space = FULL if options.synergies is None else synergy_space(options.synergies)
        self._memory = TrackMemory(options.lost)

    def start(self, observation: Observation, pose: ArrayLike | None = None) -> Estimate:
        """Begin on this frame, from a pose (27,) refined by fitting, or by searching."""
        begun = time.perf_counter()
        self._observe(observation)
        observed = time.perf_counter()
        if pose is None:
            given, _ = find_pose(self._scorer, observation.centre, self._generator(observation), self.options.search)
        else:
            given = np.asarray(pose, dtype=np.float64)
            if given.shape != (POSE_SIZE,) or not np.all(np.isfinite(given)):
                raise InputError(f"a start pose must be {POSE_SIZE} finite numbers, found shape {given.shape}")
        found = self._fitter.fit(within_limits(given), self._space)
        return self._settle(found, Status.STARTED, begun, observed)

    def track(self, observation: Observation) -> Estimate:
        """Follow the hand into the next frame; searches where the track was lost or there is none."""
        last = self._memory.pose
        if last is None:
            return self.start(observation)
        begun = time.perf_counter()
        self._observe(observation)
        observed = time.perf_counter()
        ahead = 1.0 if self.options.variant == "paper" else 0.5
        found = self._fitter.fit(within_limits(retract(last, ahead * self._memory.velocity)), self._space)
        return self._settle(found, Status.TRACKED, begun, observed)

    def recall(self, estimates: Sequence[Estimate]) -> None:
        """Take up a track after these estimates, as if they had been made just now."""
        for estimate in estimates:
            self._memory.remember(estimate)

    @property
    def expected(self) -> Array | None:
        """The linear prediction, while the track is sure."""
        return self._memory.expected

    def close(self) -> None:
        self._scorer.close()

    def _observe(self, observation: Observation) -> None:
        self._scorer.observe(Target(observation.camera, observation.skin, observation.depth))
        self._fitter.observe(observation, self.options.subsample)

    def _generator(self, observation: Observation) -> np.random.Generator:
        """Random numbers of one frame, whatever happened before: Philox keyed by seed and frame."""
        return np.random.Generator(np.random.Philox(key=[self.options.seed, observation.frame_index]))

    def _settle(self, pose: Array, status: Status, begun: float, observed: float) -> Estimate:
        fitted = time.perf_counter()
        terms = self._scorer.terms(pose[None])
        energy, confidence = float(terms.energy[0]), float(1 - terms.skin[0])
        if self._memory.is_lost(energy, confidence):
            status = Status.LOST
        stage_ms = {
            "observe": 1e3 * (observed - begun),
            "fit": 1e3 * (fitted - observed),
            "check": 1e3 * (time.perf_counter() - fitted),
        }
        estimate = Estimate(pose, energy, confidence, status, stage_ms)
        self._memory.remember(estimate)
        return estimate
