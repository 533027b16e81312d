"""The pipeline: segment each frame and track the hand in it.

The prediction of the tracker is the ROI prior of the next frame.

Runs, replay, segmentation figures, comparison, examples and live use all consume `track_frames` or `Pipeline.step`.
"""

import time
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from numpy.typing import ArrayLike

from depthtrack.errors import InputError
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape
from depthtrack.recording.run_folder import RunWriter
from depthtrack.recording.run_rows import RunRow
from depthtrack.recording.sequence import Frame
from depthtrack.recording.status import Status
from depthtrack.segmentation.observation import Observation
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.tracking.guided_segmentation import around_start, failure_of, segment
from depthtrack.tracking.keypoint_guide import KeypointGuide
from depthtrack.tracking.tracker import ABSENT, Estimate, Guide, Tracker
from depthtrack.types import Array


@dataclass(frozen=True)
class TrackedFrame:
    """One frame after the pipeline.

    observation: the segmented hand, None if there is none.
    estimate: what the tracker returned.
    segment_ms: time of the segmentation, milliseconds.
    failure: what failed unexpectedly, in one line; None in a sound frame. A failed frame is absent.
    """

    frame: Frame
    observation: Observation | None
    estimate: Estimate
    segment_ms: float
    failure: str | None = None


class Pipeline:
    """Segmentation and tracking of one frame after the other.

    start_pose: (27,) pose that is refined on the first frame with a hand; None starts by a search.
    clock: seconds, for the time of the segmentation.
    """

    def __init__(
        self,
        tracker: Tracker,
        segmenter: Segmenter,
        hand: HandShape,
        start_pose: Array | None = None,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self._tracker, self._segmenter, self._model = tracker, segmenter, HandModel(hand)
        self._keypoints = KeypointGuide(self._model)
        self._start_pose, self._clock = start_pose, clock

    def restore(self, estimates: Sequence[Estimate]) -> None:
        """Go on from estimates of earlier frames, or of the next one."""
        self._tracker.restore(estimates)

    def step(self, frame: Frame, known: Estimate | None = None) -> TrackedFrame:
        """Segment and track one frame.

        known: estimate that the tracker made of this frame before; the state is restored from it instead.
        """
        observation, milliseconds, failure = segment(
            frame, self._segmenter, self._model, self._tracker, self._keypoints, self._clock
        )
        estimate = known
        if estimate is None and observation is not None:
            try:
                estimate = self._track(observation)
            except Exception as error:
                failure = failure_of(error)
        elif estimate is not None:
            self._tracker.restore([estimate])
        if estimate is None:
            estimate = replace(ABSENT, timestamp=frame.timestamp)
            self._tracker.restore([estimate])
        observation, later = around_start(frame, observation, estimate, self._segmenter, self._model)
        self._segmenter.set_lost(estimate.status is Status.LOST, frame.timestamp)
        if estimate.pose is not None:
            self._start_pose = None
        return TrackedFrame(frame, observation, estimate, milliseconds, failure or later)

    def _track(self, observation: Observation) -> Estimate:
        if self._start_pose is not None:
            return self._tracker.start(observation, self._start_pose)
        return self._tracker.track(observation)


class NoTracker:
    """Tracker without poses or predictions, for segmentation alone."""

    name = "none"
    stages: tuple[str, ...] = ()

    def predicted_pose(self, timestamp: float) -> Array | None:
        return None

    def doubted_pose(self, timestamp: float) -> Array | None:
        return None

    def start(self, observation: Observation, pose: ArrayLike | None = None) -> Estimate:
        return ABSENT

    def track(self, observation: Observation) -> Estimate:
        return ABSENT

    def restore(self, estimates: Sequence[Estimate]) -> None:
        return None

    def close(self) -> None:
        return None


def track_frames(frames: Iterable[Frame], pipeline: Pipeline, known: Sequence[Estimate] = ()) -> Iterator[TrackedFrame]:
    """Track frames in order.

    known: estimates of the first frames, made before. Those frames are segmented again, which brings the segmentation
        to where it was, and the tracker is restored from the estimates.
    """
    for number, frame in enumerate(frames):
        yield pipeline.step(frame, known[number] if number < len(known) else None)


class _KnownPose(NamedTuple):
    """Guides the segmentation of a frame by its own pose."""

    pose: Array

    def predicted_pose(self, timestamp: float) -> Array:
        return self.pose

    def doubted_pose(self, timestamp: float) -> None:
        return None

    def restore(self, estimates: Sequence[Estimate]) -> None:
        return None


def replay_frames(
    frames: Iterable[tuple[Frame, Estimate]],
    guide: Guide,
    segmenter: Segmenter,
    hand: HandShape,
    backward: Collection[int] = (),
) -> Iterator[TrackedFrame]:
    """Segment frames again as during tracking.

    guide: restores the ROI prior from the estimates.
    backward: indices of frames that were tracked backwards. The frame before did not guide them, so their pose does.
    """
    model = HandModel(hand)
    keypoints = KeypointGuide(model)
    for frame, estimate in frames:
        own = _KnownPose(estimate.pose) if frame.index in backward and estimate.pose is not None else guide
        observation, milliseconds, failure = segment(frame, segmenter, model, own, keypoints, time.perf_counter)
        guide.restore([estimate])
        observation, later = around_start(frame, observation, estimate, segmenter, model)
        segmenter.set_lost(estimate.status is Status.LOST, frame.timestamp)
        yield TrackedFrame(frame, observation, estimate, milliseconds, failure or later)


def write_run(tracked: Iterable[TrackedFrame], run: RunWriter) -> Iterator[TrackedFrame]:
    """Append tracked frames to a run folder; yield those that it did not hold before.

    Raises:
        InputError: if the frames that it holds are not the first ones.
    """
    held = len(run.rows)
    for number, each in enumerate(tracked):
        if number < held:
            if (found := run.rows[number].index) != each.frame.index:
                raise InputError(
                    f"{run.folder / 'poses.csv'}, line {number + 2}: expected frame {each.frame.index}, found {found}: "
                    "remove the lines from there on, and resume"
                )
            continue
        row = row_of(each.frame.index, replace(each.estimate, timestamp=each.frame.timestamp))
        run.append(row, {"segment": each.segment_ms, **each.estimate.stage_ms}, each.failure)
        yield each


def row_of(index: int, estimate: Estimate) -> RunRow:
    """Return the row of a frame in a run folder."""
    return RunRow(
        index,
        estimate.timestamp,
        estimate.status,
        estimate.energy,
        estimate.agreement,
        estimate.pose,
        estimate.confidence,
        estimate.visibility,
        estimate.spread,
        estimate.branches,
    )


def estimates_of(rows: Iterable[RunRow]) -> list[Estimate]:
    """Return the estimates that a run folder holds."""
    return [
        Estimate(
            row.pose,
            row.energy,
            row.agreement,
            row.status,
            {},
            row.timestamp,
            row.confidence,
            row.visibility,
            row.spread,
            row.branches,
        )
        for row in rows
    ]
