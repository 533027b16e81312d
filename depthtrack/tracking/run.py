"""One run: a recording, its configuration, and the pipeline that tracks it."""

import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from itertools import islice
from pathlib import Path
from typing import Any

from depthtrack.closing import Closing
from depthtrack.errors import InputError, is_text
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape
from depthtrack.recording.keypoints import read_keypoints
from depthtrack.recording.read_ahead import read_ahead
from depthtrack.recording.registry import reading_of
from depthtrack.recording.run_continuation import check_unused
from depthtrack.recording.run_folder import BACKWARD_STAGE, RunWriter
from depthtrack.recording.sequence import Frame, Sequence
from depthtrack.segmentation.options import SegmentationOptions
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.strict_data import parse_json
from depthtrack.tracking.backward_options import BackwardOptions
from depthtrack.tracking.backward_pass import doubtful_stretches, track_backwards
from depthtrack.tracking.configuration import LiftConfig, MarkersConfig, TrackerConfig
from depthtrack.tracking.pipeline import Pipeline, TrackedFrame, estimates_of, row_of, track_frames, write_run
from depthtrack.tracking.registry import create_tracker
from depthtrack.tracking.run_configuration import RunConfiguration, camera_fields, versions
from depthtrack.tracking.tracker import Tracker
from depthtrack.types import Array


def configure(
    path: Path,
    sequence: Sequence,
    tracker: TrackerConfig,
    hand: HandShape,
    segmentation: SegmentationOptions | None = None,
    **entries: Any,
) -> RunConfiguration:
    """Return the configuration of a run of the recording at `path`, read as `sequence` was.

    entries: `start`, `frames`, `on_damage`, `keypoints` and `backward` of `RunConfiguration`, if not the defaults.
    """
    place = str(path.resolve())
    if not is_text(place):
        raise InputError(f"the path of a recording must be UTF-8 text, found {place[:200]!r}: rename the folder")
    return RunConfiguration(
        place,
        camera_fields(sequence.camera),
        parse_json(hand.to_json()),
        tracker,
        segmentation or SegmentationOptions(),
        **entries,
        reading=reading_of(sequence),
        context={"versions": versions()},
    )


class TrackingRun(Closing):
    """Run of a tracker on a recording; equal configurations give equal bits.

    threads: threads of renderer and fits; poses do not depend on it.
    wrap: returns the tracker to use in place of the one that the configuration describes, to time it for example.
    clock: seconds, for the time of the segmentation.

    Raises:
        InputError: if the configuration does not fit the recording, or a file that it names cannot be read.
    """

    def __init__(
        self,
        configuration: RunConfiguration,
        sequence: Sequence,
        threads: int = 1,
        wrap: Callable[[Tracker], Tracker] = lambda tracker: tracker,
        clock: Callable[[], float] = time.perf_counter,
        ahead: int = 2,
    ) -> None:
        self.configuration, self.sequence, self._ahead = configuration, sequence, ahead
        self.hand = configuration.hand_shape()
        self._clock, self._start_pose = clock, true_start(sequence) if configuration.start == "truth" else None
        named = configuration.keypoints
        if named is None and isinstance(configuration.tracker, LiftConfig):
            raise InputError("the tracker lift must have keypoints, found none: give --keypoints FILE.csv")
        self._keypoints = None if named is None else read_keypoints(Path(named))
        self._create: Callable[[], Tracker] = lambda: wrap(create_tracker(configuration.tracker, self.hand, threads))
        self.tracker = self._create()

    def __len__(self) -> int:
        """Return the number of frames to track."""
        frames, length = self.configuration.frames, len(self.sequence)
        return length if frames is None else min(frames, length)

    def track(self) -> Iterator[TrackedFrame]:
        """Yield each frame as it is tracked, forward alone."""
        return track_frames(self._frames(), self._pipeline(self._start_pose))

    def write(
        self, folder: Path, resume: bool = False, progress: Callable[[int, int], None] | None = None
    ) -> Iterator[TrackedFrame]:
        """Yield each frame after it is tracked and appended to a run folder; then track backwards.

        resume: track only the frames that the folder lacks.
        progress: called with the numbers of frames that are tracked backwards, and that will be.

        Raises:
            InputError: if the folder holds another run, or a run and `resume` is false.
        """
        fields, backward = self.configuration.to_fields(), self.configuration.backward
        stages = ("segment", *self.tracker.stages, *(() if backward is None else (BACKWARD_STAGE,)))
        with RunWriter(folder, fields, stages, resume, len(self)) as run:
            if run.revised:
                return
            known = estimates_of(run.rows)
            awaiting = all(estimate.pose is None for estimate in known)
            pipeline = self._pipeline(self._start_pose if awaiting else None)
            yield from write_run(track_frames(self._frames(), pipeline, known), run)
            if backward is not None:
                self._track_backwards(run, backward, progress)

    def _track_backwards(
        self, run: RunWriter, options: BackwardOptions, progress: Callable[[int, int], None] | None
    ) -> None:
        """Track the doubtful stretches of a run backwards, and write what is better so."""
        tracking = self.configuration.tracker
        assert not isinstance(tracking, MarkersConfig)  # has no tracker
        forward = estimates_of(run.rows)
        if not doubtful_stretches(forward, options):
            return
        with closing(self._create()) as tracker:
            found = track_backwards(
                forward,
                lambda places: self._frames([run.rows[place].index for place in places]),
                lambda: self._pipeline(None, tracker),
                HandModel(self.hand).keypoints,
                tracking.scoring.objective.clamp,
                options,
                progress,
            )
        run.revise(
            {place: row_of(run.rows[place].index, each) for place, each in found.estimates.items()},
            {place: each.milliseconds for place, each in found.frames.items()},
            {place: each.failure for place, each in found.frames.items() if each.failure is not None},
        )

    def _frames(self, indices: Iterable[int] | None = None) -> Iterator[Frame]:
        """Yield some frames, or all that are tracked, with their keypoints."""
        frames: Iterator[Frame] = islice(self.sequence, len(self)) if indices is None else self.sequence.frames(indices)
        if self._keypoints is not None:
            frames = self._keypoints.attach(frames, self.sequence.timestamps)
        return read_ahead(frames, self._ahead)

    def _pipeline(self, start_pose: Array | None, tracker: Tracker | None = None) -> Pipeline:
        segmenter = Segmenter.for_sequence(self.sequence, self.configuration.segmentation)
        return Pipeline(tracker or self.tracker, segmenter, self.hand, start_pose, self._clock)

    def close(self) -> None:
        """Free the tracker."""
        self.tracker.close()


def check_run(
    configuration: RunConfiguration, sequence: Sequence, folder: Path | None = None, resume: bool = False
) -> None:
    """Check that a run can begin, before the hand is measured for it.

    folder: where it will be written, if anywhere.

    Raises:
        InputError: as `TrackingRun`, or if the folder holds a run and `resume` is false.
    """
    if folder is not None:
        check_unused(folder, resume)
    TrackingRun(configuration, sequence).close()


def true_start(sequence: Sequence) -> Array:
    """Return the true pose (27,) of the recording's first frame.

    Raises:
        InputError: if it has none.
    """
    truth = sequence.ground_truth
    row = None if truth is None else truth.at(float(sequence.timestamps[0]))
    if truth is None or truth.poses is None or row is None:
        raise InputError(f"{sequence.name} has no true pose of its first frame: use --start auto")
    return truth.poses[row]
