"""The frame that a tracker works on, and the renderers and fitters that its stages share."""

import math
from dataclasses import dataclass, field, replace
from functools import cache, cached_property

import numpy as np

from depthtrack.geometry.camera import Camera
from depthtrack.hand.compiled_kinematics import BodyPoses, endpoints
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape
from depthtrack.hand.synergies import Synergies, load_synergies
from depthtrack.recording.branches import Branch
from depthtrack.rendering.backends import create_scorer
from depthtrack.rendering.options import ScoringOptions
from depthtrack.rendering.scorer import Scorer
from depthtrack.segmentation.observation import Observation
from depthtrack.solver.icp import IcpFitter
from depthtrack.solver.lifting import Lifter
from depthtrack.solver.options import IcpOptions, LiftOptions, SurfaceFitOptions, SurfaceName
from depthtrack.solver.parallel_fits import ParallelFits
from depthtrack.tracking.candidate import Candidate, evaluate
from depthtrack.tracking.random import frame_generator
from depthtrack.tracking.spread import bones_in_view
from depthtrack.tracking.state import InterruptedSearch, TrackState
from depthtrack.tracking.surfaces.registry import make_surface
from depthtrack.tracking.timing import Deadline
from depthtrack.types import Array

TO_BEGIN = 0.5
"""Share of the deadline that must be left to begin a search: its proposals are scored at once."""


class Toolkit:
    """Scorers, fitters and synergies of one hand, created on first use and then kept."""

    def __init__(
        self, hand: HandShape, scoring: ScoringOptions, threads: int = 1, synergies: Synergies | None = None
    ) -> None:
        self.hand, self.model, self.scoring = hand, HandModel(hand), scoring
        threaded = {"threads": threads} if scoring.renderer == "raster" else {}
        self.scorer = create_scorer(scoring.renderer, hand, scoring.objective, **threaded)
        self.fits = ParallelFits(threads)
        self.synergies = synergies or load_synergies()
        self._coarse: dict[int, Scorer] = {}
        self._fitters: dict[SurfaceFitOptions, IcpFitter] = {}
        self._lifters: dict[LiftOptions, Lifter] = {}
        self._targets: dict[object, Observation] = {}
        self._frame_camera: Camera | None = None

    def set_target(self, observation: Observation) -> None:
        """Set the observation that the scorer compares with."""
        self._frame_camera = observation.frame_camera
        resolution = self.scoring.resolution
        self.scorer.set_target(observation if resolution is None else observation.reduced(resolution))

    def share_in_image(self, pose: Array) -> float:
        """Return the share of the fingers' keypoints in a pose (27,) that the image shows.

        The image is that of the last target; the share is 1 if it is unknown.
        """
        if (camera := self._frame_camera) is None:
            return 1.0
        ends = np.empty((5, 4, 3))
        endpoints(self.model.chain, BodyPoses.at(self.model.chain, pose), ends)
        pixels = camera.project(ends)
        inside = (pixels >= -0.5) & (pixels < (camera.width - 0.5, camera.height - 0.5))
        return float(inside.all(axis=-1).mean())

    def scorer_at(self, resolution: int | None, observation: Observation) -> Scorer:
        """Return a scorer of `observation` at a resolution.

        resolution: longest side in pixels; None selects the main scorer.
        """
        if resolution is None:
            return self.scorer
        if resolution not in self._coarse:
            self._coarse[resolution] = create_scorer(self.scoring.renderer, self.hand, self.scoring.objective)
        scorer = self._coarse[resolution]
        if self._targets.get(resolution) is not observation:
            scorer.set_target(self.scorer.target.reduced(resolution))
            self._targets[resolution] = observation
        return scorer

    def fitter(self, options: SurfaceFitOptions, observation: Observation) -> IcpFitter:
        """Return a surface fitter with these options for `observation`.

        Raises:
            InputError: if no skin fits the sizes of the hand.
        """
        if options not in self._fitters:
            surface = make_surface(options.surface, self.hand, self.scoring.renderer, options.sampling)
            self._fitters[options] = IcpFitter(self.hand, surface, options.icp)
        fitter = self._fitters[options]
        if self._targets.get(options) is not observation:
            fitter.set_target(observation, options.step(observation.reading_count))
            self._targets[options] = observation
        return fitter

    def lifter(self, options: LiftOptions) -> Lifter:
        """Return a lifter of keypoints with these options."""
        if options not in self._lifters:
            self._lifters[options] = Lifter(self.model, self.synergies, options)
        return self._lifters[options]

    def close(self) -> None:
        """Free the renderers, and end the threads of fits."""
        self.fits.close()
        for scorer in (self.scorer, *self._coarse.values()):
            scorer.close()


@dataclass
class FrameContext:
    """One frame on its way through the stages.

    start_pose: (27,) pose given by the user, or None.
    predictions: candidates that `Predict` made, best first.
    restarted: whether a search replaced the track, so that the status becomes `started`.
    branches: alternatives to the pose that the next frame goes on with.
    surface: surface that all fits of the frame use, None for that of their options.
    deadline: time at which searches end.
    search: search for the hand that the deadline interrupted, which the next frame goes on with.
    anew: whether a search starts from the observation alone, without the last pose.
    """

    observation: Observation
    tools: Toolkit
    state: TrackState
    seed: int
    start_pose: Array | None = None
    predictions: list[Candidate] = field(default_factory=list)
    restarted: bool = False
    branches: tuple[Branch, ...] = ()
    surface: SurfaceName | None = None
    deadline: Deadline = field(default_factory=Deadline)
    search: InterruptedSearch | None = None
    anew: bool = False

    @cached_property
    def random(self) -> np.random.Generator:
        """Random numbers of the frame, which the stages share."""
        return self.new_random()

    def new_random(self) -> np.random.Generator:
        """Return the frame's random numbers from their start."""
        return frame_generator(self.seed, self.observation.frame_index)

    @property
    def last_pose(self) -> Array | None:
        """Pose (27,) of the last frame; None without one, or if a search leaves it out."""
        return None if self.anew else self.state.pose

    @property
    def motion(self) -> Array:
        """Predicted step (26,) from the last pose to this frame, in the tangent space."""
        return self.state.motion_until(self.observation.timestamp)

    def posture_kept(self, options: IcpOptions) -> float:
        """Return the share of the last posture's distance from the mean one that a prior keeps.

        It keeps the posture of a given pose.
        """
        if self.start_pose is not None:
            return 1.0
        if self.last_pose is None:
            return options.search_share
        return math.exp(-max(self.observation.timestamp - self.state.time, 0.0) / options.posture_memory)

    @property
    def clamp(self) -> float:
        """Unit of energies in options: see `Objective.clamp`."""
        return self.tools.scoring.objective.clamp

    def puts_search_off(self) -> bool:
        """Return whether the deadline leaves too little time to begin a search.

        The next frame begins it then.
        """
        if not self.deadline.sooner(TO_BEGIN).is_over:
            return False
        self.search = InterruptedSearch.put_off(self.observation.centre)
        return True

    def evaluate(self, poses: Array, resolution: int | None = None) -> list[Candidate]:
        """Score poses (N, 27); return them by increasing energy.

        resolution: longest side in pixels; None for that of the main scorer.
        """
        return evaluate(self.tools.scorer_at(resolution, self.observation), poses)

    def finger_visibility(self, pose: Array) -> Array:
        """Return the visible share (5,) of each finger in a pose (27,)."""
        scorer = self.tools.scorer
        return bones_in_view(self.tools.model, pose, scorer.render(pose), scorer.target).finger_visibility

    def fitter(self, options: SurfaceFitOptions) -> IcpFitter:
        """Return a surface fitter for this frame.

        Raises:
            InputError: if no skin fits the sizes of the hand.
        """
        chosen = options if self.surface is None else _with_surface(options, self.surface)
        return self.tools.fitter(chosen, self.observation)


@cache
def _with_surface(options: SurfaceFitOptions, surface: SurfaceName) -> SurfaceFitOptions:
    """Return the options of a fit to another surface."""
    return replace(options, surface=surface)
