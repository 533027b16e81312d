"""Tracker made of stages: lists of stages over candidates, and the state between frames."""

from collections.abc import Sequence
from dataclasses import dataclass

from numpy.typing import ArrayLike

from depthtrack.recording.status import Status
from depthtrack.segmentation.observation import Observation
from depthtrack.tracking.candidate import Candidate
from depthtrack.tracking.frame import FrameContext, Toolkit
from depthtrack.tracking.options import TrackingThresholds
from depthtrack.tracking.random import checked_pose
from depthtrack.tracking.stages.stage import Stage
from depthtrack.tracking.state import TrackState
from depthtrack.tracking.timing import StageClock
from depthtrack.tracking.tracker import Estimate
from depthtrack.types import Array


@dataclass(frozen=True)
class Stages:
    """Lists of stages of a tracker.

    follow: stages from the pose of the last frame.
    start: stages without a pose.
    refine: stages from a pose that the user gave.
    """

    follow: Sequence[Stage]
    start: Sequence[Stage]
    refine: Sequence[Stage]


class StageTracker:
    """Tracker with lists of stages: see `tracker.Tracker`."""

    def __init__(self, name: str, stages: Stages, tools: Toolkit, thresholds: TrackingThresholds, seed: int) -> None:
        self.name, self._stages, self._tools, self._seed = name, stages, tools, seed
        self._state = TrackState(thresholds, tools.scoring.objective.clamp)
        listed = (stage.name for stage in (*stages.follow, *stages.start, *stages.refine))
        self.stages: tuple[str, ...] = tuple(dict.fromkeys(("target", *listed)))

    def start(self, observation: Observation, pose: ArrayLike | None = None) -> Estimate:
        """Start on this frame: refine a pose (27,), or search if there is none."""
        self._state.forget_last()
        if pose is None:
            return self._run(self._stages.start, self._frame(observation), Status.STARTED)
        return self._run(self._stages.refine, self._frame(observation, checked_pose(pose)), Status.STARTED)

    def track(self, observation: Observation) -> Estimate:
        """Follow the hand into the next frame; search if the track is lost or there is none."""
        if self._state.pose is None:
            return self._run(self._stages.start, self._frame(observation), Status.STARTED)
        return self._run(self._stages.follow, self._frame(observation), Status.TRACKED)

    def restore(self, estimates: Sequence[Estimate]) -> None:
        """Update the state with estimates as if they had been made now."""
        self._state.restore(estimates)

    @property
    def predicted_pose(self) -> Array | None:
        """Linear prediction (27,) of the next pose; None if it must not guide the segmentation."""
        return self._state.predicted_pose

    def close(self) -> None:
        """Free the renderers."""
        self._tools.close()

    def _frame(self, observation: Observation, pose: Array | None = None) -> FrameContext:
        return FrameContext(observation, self._tools, self._state, self._seed, pose)

    def _run(self, stages: Sequence[Stage], frame: FrameContext, status: Status) -> Estimate:
        clock = StageClock(self.stages)
        self._tools.set_target(frame.observation)
        clock.lap("target")
        candidates: list[Candidate] = []
        for stage in stages:
            candidates = stage(frame, candidates)
            clock.lap(stage.name)
        status = Status.STARTED if frame.restarted else status
        return self._state.commit(*candidates[0], status, clock.milliseconds)
