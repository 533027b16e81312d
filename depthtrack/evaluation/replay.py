"""Replay a run on its recording: every frame with its observation and estimate."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from depthtrack.errors import DamagedFrameError, InputError
from depthtrack.hand.pose import transformed
from depthtrack.hand.shape import HandShape
from depthtrack.recording import open_sequence
from depthtrack.recording.keypoints import read_keypoints
from depthtrack.recording.run_folder import Run
from depthtrack.recording.sequence import Frame, Sequence
from depthtrack.rendering.hand_surface import HandSurface
from depthtrack.segmentation.observation import Observation
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.tracking.configuration import MarkersConfig
from depthtrack.tracking.pipeline import replay_frames
from depthtrack.tracking.run_configuration import RunConfiguration
from depthtrack.tracking.state import TrackState
from depthtrack.tracking.tracker import Estimate
from depthtrack.types import Array

_SAME_TIME = 1e-6
"""Largest difference in the time of a frame between run and recording, s."""
_SAMPLED_FRAMES = 5
"""Number of frames that decide which surface a run fitted."""


@dataclass(frozen=True)
class ReplayedFrame:
    """One frame of a run.

    row: row of the frame in the run.
    frame: frame of the recording.
    observation: segmented hand; None if there is none.
    estimate: estimate of the run, its pose in the camera frame.
    """

    row: int
    frame: Frame
    observation: Observation | None
    estimate: Estimate


@dataclass(frozen=True)
class Replay:
    """A run and its recording, which is opened with the camera of the run.

    The poses of the run are in the world frame of the recording, see `Sequence.T_camera_world`.
    """

    run: Run
    configuration: RunConfiguration
    sequence: Sequence
    hand: HandShape

    @classmethod
    def open(cls, run: Run, sequence: Path | None = None) -> "Replay":
        """Return the replay of a run.

        sequence: path of the recording, if it was moved.

        Raises:
            InputError: if the recording is missing or is another one, or `run.json` is malformed.
        """
        configuration, where = RunConfiguration.of(run), str(run.folder / "run.json")
        path = sequence or recorded_path(run)
        if sequence is None and not path.exists():
            raise InputError(f"the recording {path} of the run {run.folder} is missing: give --sequence PATH")
        recording = open_sequence(path, configuration.camera_model(where), "skip", configuration.reading)
        _check_same_recording(run, recording, path)
        return cls(run, configuration, recording, configuration.hand_shape(where))

    @cached_property
    def camera_poses(self) -> Array:
        """Poses (T, 27) of the run in the camera frame."""
        return transformed(self.run.poses, self.sequence.T_camera_world)

    def surface(self) -> HandSurface:
        """Return the surface that the tracker fitted; the rig if the hand has one.

        If the tracker chose between surfaces, it is the one that lies closest to the depth of some frames.

        Raises:
            InputError: if the sizes give no skin, or the file of the rig is missing or changed.
        """
        names = dict.fromkeys(name == "skin" or self.hand.rig is not None for name in self.configuration.surfaces)
        surfaces = [HandSurface.of(self.hand, skin=skin) for skin in names]
        return surfaces[0] if len(surfaces) == 1 else min(surfaces, key=self._distance)

    def _distance(self, surface: HandSurface) -> float:
        """Return the median distance, metres, between a drawn surface and the depth of some frames."""
        rows = np.flatnonzero([status.is_trusted for status in self.run.status])
        apart: list[Array] = [np.zeros(0)]
        for row in rows[np.linspace(0, len(rows) - 1, min(len(rows), _SAMPLED_FRAMES)).astype(int)]:
            try:
                frame = self.at(int(row)).frame
            except DamagedFrameError:
                continue
            drawn = surface.render(self.camera_poses[row], frame.camera).depth
            both = (drawn > 0) & (frame.depth > 0)
            apart.append(np.abs(drawn - frame.depth)[both].astype(np.float64))
        distances = np.concatenate(apart)
        return float(np.median(distances)) if len(distances) else 0.0

    def __len__(self) -> int:
        """Return the number of frames of the run."""
        return len(self.run.index)

    def at(self, row: int) -> ReplayedFrame:
        """Return one frame without its observation, which depends on all earlier frames.

        Raises:
            DamagedFrameError: if the frame is unreadable.
        """
        return ReplayedFrame(row, self.sequence[int(self.run.index[row])], None, self._estimate(row))

    def __iter__(self) -> Iterator[ReplayedFrame]:
        """Yield every readable frame, segmented with the options of the run and guided by its poses.

        Frames without depth images have no observation.

        Raises:
            InputError: if the run was solved from markers, and the recording has depth images.
        """
        if not self.sequence.has_depth:
            for row in range(len(self)):
                yield self.at(row)
            return
        guide = self._guide()
        segmenter = Segmenter.for_sequence(self.sequence, self.configuration.segmentation)
        row_of = {int(index): row for row, index in enumerate(self.run.index)}
        frames = self.sequence.frames(map(int, self.run.index))
        if self.configuration.keypoints is not None:
            keypoints = read_keypoints(Path(self.configuration.keypoints))
            frames = keypoints.attach(frames, self.sequence.timestamps)
        known = ((frame, self._estimate(row_of[frame.index])) for frame in frames)
        for each in replay_frames(known, guide, segmenter, self.hand, self.run.backward):
            yield ReplayedFrame(row_of[each.frame.index], each.frame, each.observation, each.estimate)

    def _estimate(self, row: int) -> Estimate:
        """Return the estimate of one frame, its pose in the camera frame."""
        estimate = estimate_of(self.run, row)
        return estimate if estimate.pose is None else replace(estimate, pose=self.camera_poses[row])

    def _guide(self) -> TrackState:
        """Return the state of a track that the estimates of the run restore.

        Raises:
            InputError: if the run was solved from markers.
        """
        options = self.configuration.tracker
        if isinstance(options, MarkersConfig):
            raise InputError(f"the run {self.run.folder} was solved from markers: leave out --sequence")
        has_deadline = getattr(options, "deadline", None) is not None
        return TrackState(options.thresholds, options.scoring.objective.clamp, reconsiders=not has_deadline)


def estimate_of(run: Run, row: int) -> Estimate:
    """Return the estimate of one frame of a run."""
    pose = run.poses[row]
    return Estimate(
        pose if np.isfinite(pose).all() else None,
        float(run.energy[row]),
        float(run.agreement[row]),
        run.status[row],
        {stage: float(values[row]) for stage, values in run.stage_ms.items() if row < len(values)},
        float(run.timestamps[row]),
        float(run.confidence[row]),
        tuple(map(float, run.visibility[row])),
        tuple(map(float, run.spread[row])),
    )


def run_hand(run: Run) -> HandShape:
    """Return the hand of the tracker of a run.

    Raises:
        InputError: if `run.json` is malformed.
    """
    return RunConfiguration.of(run).hand_shape(str(run.folder / "run.json"))


def recorded_path(run: Run) -> Path:
    """Return the path of the recording when it was tracked.

    Raises:
        InputError: if `run.json` is malformed.
    """
    return run.folder / RunConfiguration.of(run).sequence


def _check_same_recording(run: Run, sequence: Sequence, path: Path) -> None:
    """Raise InputError unless the frames of the run are those of the recording."""
    outside = (run.index < 0) | (run.index >= len(sequence))
    if outside.any():
        raise InputError(
            f"{path} has {len(sequence)} frames, but the run {run.folder} tracked frame {run.index[outside][0]}: "
            "give the recording of the run with --sequence"
        )
    differences = np.abs(sequence.timestamps[run.index] - run.timestamps)
    # The negated comparison also rejects NaN.
    if len(differences) and not differences.max() <= _SAME_TIME:
        index = run.index[differences.argmax()]
        raise InputError(
            f"frame {index} of {path} was taken at {sequence.timestamps[index]:.12g} s, but at "
            f"{run.timestamps[differences.argmax()]:.12g} s in the run {run.folder}: "
            "give the recording of the run with --sequence"
        )
