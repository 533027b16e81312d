"""A run beside its recording: every frame as the tracker saw it, with what the tracker said of it."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from depthtrack.errors import InputError
from depthtrack.geometry.camera import Camera
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape
from depthtrack.recording import open_sequence
from depthtrack.recording.run_folder import Run
from depthtrack.recording.sequence import Frame, Sequence
from depthtrack.rendering.hand_surface import HandSurface
from depthtrack.segmentation.observation import Observation, Segmenter
from depthtrack.tracking.pipeline import roi_prior
from depthtrack.tracking.state import TrackingThresholds, TrackState
from depthtrack.tracking.tracker import Estimate

_SAME_TIME = 1e-6
_LONGEST_PATH = 1024
"""Characters."""


@dataclass(frozen=True)
class ReplayedFrame:
    """One frame of a run: `row` in the run, the recording's `frame`, the hand observed in it (None without one), and
    the tracker's `estimate`."""

    row: int
    frame: Frame
    observation: Observation | None
    estimate: Estimate


@dataclass(frozen=True)
class Replay:
    """A run and its recording, opened with the run's own camera."""

    run: Run
    sequence: Sequence
    hand: HandShape

    @classmethod
    def open(cls, run: Run, sequence: Path | None = None) -> "Replay":
        """The run beside the recording it tracked, or beside `sequence` where that has moved. Raises InputError."""
        path = sequence or recorded_path(run)
        if sequence is None and not path.exists():
            raise InputError(
                f"the recording {path} of the run {run.folder} is not there any more: give --sequence PATH"
            )
        recording = open_sequence(path, _camera(run), on_damage="skip")
        _check_same_recording(run, recording, path)
        return cls(run, recording, run_hand(run))

    def surface(self) -> HandSurface:
        """Return the surface that the run fitted; a user's rig if the hand has one.

        Raises: InputError if the sizes give no skin, or if the rig's file is missing or changed.
        """
        fitted = {self.run.configuration.get(name) for name in ("model", "finish")}
        return HandSurface.of(self.hand, skin="skin" in fitted or self.hand.rig is not None)

    def __len__(self) -> int:
        return len(self.run.index)

    def at(self, row: int) -> ReplayedFrame:
        """One frame, without looking for the hand in it, which takes all frames before. Raises DamagedFrameError."""
        return ReplayedFrame(row, self.sequence[int(self.run.index[row])], None, estimate_of(self.run, row))

    def __iter__(self) -> Iterator[ReplayedFrame]:
        """Every frame that is still readable, observed with the run's own settings and guided by its own poses."""
        run, model, memory = self.run, HandModel(self.hand), TrackState(TrackingThresholds())
        segmenter = Segmenter.for_sequence(self.sequence, _path(run, "skin_model"))
        row_of = {int(index): row for row, index in enumerate(run.index)}
        for frame in self.sequence.frames(map(int, run.index)):
            row = row_of[frame.index]
            observation = segmenter.segment(frame, roi_prior(model, memory.predicted_pose))
            estimate = estimate_of(run, row)
            memory.update(estimate)
            yield ReplayedFrame(row, frame, observation, estimate)


def estimate_of(run: Run, row: int) -> Estimate:
    """What the tracker said of one frame."""
    pose = run.poses[row]
    return Estimate(
        pose if np.isfinite(pose).all() else None,
        float(run.energy[row]),
        float(run.confidence[row]),
        run.status[row],
        {stage: float(values[row]) for stage, values in run.stage_ms.items() if row < len(values)},
    )


def run_hand(run: Run) -> HandShape:
    """The hand that a run was tracked with. Raises InputError."""
    try:
        return HandShape.from_fields(run.configuration["hand"])
    except (KeyError, TypeError, ValueError, AttributeError, InputError) as error:
        raise InputError(f"{run.folder / 'run.json'} names no usable hand: {error}") from error


def recorded_path(run: Run) -> Path:
    """Where the run's recording was. Raises InputError when run.json does not say."""
    path = _path(run, "sequence")
    if path is None:
        raise InputError(f"{run.folder / 'run.json'} does not say which recording it tracked: give --sequence PATH")
    return path


def _path(run: Run, name: str) -> Path | None:
    """A path that run.json names, or None. Raises InputError for one that no system takes."""
    path = run.configuration.get(name)
    if not isinstance(path, str):
        return None
    if len(path) > _LONGEST_PATH or "\0" in path:
        raise InputError(f"{run.folder / 'run.json'}: {name} is no path: {path[:80]!r}")
    return Path(path)


def _camera(run: Run) -> Camera | None:
    """The camera that the run was tracked with; None leaves the recording its own."""
    fields: Any = run.configuration.get("camera")
    try:
        return None if fields is None else Camera.from_fields(fields)
    except InputError as error:
        raise InputError(f"{run.folder / 'run.json'}: {error}") from error


def _check_same_recording(run: Run, sequence: Sequence, path: Path) -> None:
    """Raises InputError unless the run's frames are the recording's."""
    outside = (run.index < 0) | (run.index >= len(sequence))
    if outside.any():
        raise InputError(
            f"{path} has {len(sequence)} frames, but the run {run.folder} tracked frame {run.index[outside][0]}: "
            "--sequence must name the recording that the run was made from"
        )
    apart = np.abs(sequence.timestamps[run.index] - run.timestamps)
    if len(apart) and not apart.max() <= _SAME_TIME:  # not: NaN is no time
        index = run.index[apart.argmax()]
        raise InputError(
            f"frame {index} of {path} was taken at {sequence.timestamps[index]:.12g} s, but at "
            f"{run.timestamps[apart.argmax()]:.12g} s in the run {run.folder}: --sequence must name the recording that "
            "the run was made from"
        )
