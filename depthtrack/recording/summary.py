"""A summary of a recording, gathered in one pass over its frames."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from depthtrack.errors import DamagedFrameError
from depthtrack.geometry.camera import Camera
from depthtrack.recording.colour_registration import measure_shift
from depthtrack.recording.depth_checks import depth_notes
from depthtrack.recording.depth_histogram import STORED_VALUES, add_stored
from depthtrack.recording.sequence import DamagedFrame, Frame, OnDamage, Sequence
from depthtrack.types import Array, Index

GAP_FACTOR = 1.5
"""A step in time longer than this many median steps is a gap: at least one frame is missing."""
DEPTH_PERCENTILES = (0, 1, 50, 99, 100)


@dataclass(frozen=True)
class Gap:
    """A step in time that is too long: its start and its length, seconds."""

    after: float
    length: float


@dataclass(frozen=True)
class RecordingSummary:
    """Properties of a recording.

    frames, frames_read: listed frames, and those read for this summary.
    duration: seconds.
    rate: frames per second; None for a single frame.
    field_of_view: (horizontal, vertical), radians.
    depth_percentiles: metres by percentile of the readings; None without a reading.
    missing: share of pixels without a reading.
    colours, masks, exact_depths: frames with them, among those read.
    poses, joints: annotated frames, among those listed.
    damaged_colour: frames read whose colour cannot be.
    """

    name: str
    frames: int
    duration: float
    rate: float | None
    gaps: list[Gap]
    camera: Camera
    field_of_view: tuple[float, float]
    frames_read: int
    depth_percentiles: dict[int, float] | None
    missing: float
    colours: int
    masks: int
    exact_depths: int
    poses: int
    joints: int
    hand: str | None
    description: dict[str, Any]
    damaged: list[DamagedFrame]
    damaged_colour: list[DamagedFrame]
    notes: list[str]


def summarise(
    sequence: Sequence,
    indices: Iterable[int],
    on_damage: OnDamage = "refuse",
    progress: Callable[[Iterable[Frame]], Iterable[Frame]] = iter,
) -> RecordingSummary:
    """Read the frames `indices` of `sequence` once; memory does not grow with their number.

    on_damage: the value that the sequence was opened with, applied to masks and exact depth too.
    progress: wraps the iteration of frames to show progress.

    Raises:
        DamagedFrameError: if `on_damage` is "refuse" and an image cannot be read.
        InputError: if no frame can be read.
    """
    counts = _Counts(sequence, on_damage)
    for frame in progress(sequence.frames(indices)):
        counts.add(frame)
    steps = np.diff(sequence.timestamps)
    step = float(np.median(steps)) if len(steps) else None
    truth = sequence.ground_truth
    annotated = sum(truth.at(t) is not None for t in sequence.timestamps) if truth else 0
    return RecordingSummary(
        name=sequence.name,
        frames=len(sequence),
        duration=float(sequence.timestamps[-1] - sequence.timestamps[0]),
        rate=None if step is None else 1 / step,
        gaps=[] if step is None else _gaps(sequence.timestamps, steps, GAP_FACTOR * step),
        camera=sequence.camera,
        field_of_view=field_of_view(sequence.camera),
        frames_read=counts.frames,
        depth_percentiles=counts.depth_percentiles(),
        missing=counts.missing_share(),
        colours=counts.colours,
        masks=counts.masks,
        exact_depths=counts.exact_depths,
        poses=annotated if truth and truth.poses is not None else 0,
        joints=annotated if truth and (truth.joints is not None or truth.benchmark is not None) else 0,
        hand=f"{sequence.hand.side}, scale {sequence.hand.scale:g}" if sequence.hand else None,
        description=dict(sequence.description),
        damaged=sorted([*sequence.damaged, *counts.damaged], key=lambda frame: frame.index),
        damaged_colour=sequence.damaged_colour,
        notes=[*sequence.notes, *counts.depth_notes(), *_shift_note(sequence)],
    )


def _shift_note(sequence: Sequence) -> list[str]:
    """Return a sentence if the colour is not registered to the depth."""
    shift = measure_shift(sequence) if sequence.has_colour and sequence.has_depth else None
    return [shift.note] if shift is not None and shift.is_sure else []


def field_of_view(camera: Camera) -> tuple[float, float]:
    """Return the (horizontal, vertical) angle between the outer edges of the image, radians."""
    return (
        math.atan((camera.cx + 0.5) / camera.fx) + math.atan((camera.width - 0.5 - camera.cx) / camera.fx),
        math.atan((camera.cy + 0.5) / camera.fy) + math.atan((camera.height - 0.5 - camera.cy) / camera.fy),
    )


class _Counts:
    """Running counts over the frames, with one histogram of the stored depth units."""

    def __init__(self, sequence: Sequence, on_damage: OnDamage) -> None:
        self._sequence = sequence
        self._on_damage = on_damage
        self._histogram: Index = np.zeros(STORED_VALUES, dtype=np.int64)
        self.frames = self.colours = self.masks = self.exact_depths = 0
        self.damaged: list[DamagedFrame] = []

    def add(self, frame: Frame) -> None:
        add_stored(self._histogram, frame)
        self.frames += 1
        self.colours += frame.colour is not None
        self.masks += self._has(self._sequence.hand_mask, frame)
        self.exact_depths += self._has(self._sequence.exact_depth, frame)

    def _has(self, read: Callable[[int], object], frame: Frame) -> bool:
        try:
            return read(frame.index) is not None
        except DamagedFrameError as error:
            if self._on_damage == "refuse":
                raise
            self.damaged.append(DamagedFrame(frame.index, frame.timestamp, str(error)))
            return False

    def depth_percentiles(self) -> dict[int, float] | None:
        readings = np.cumsum(self._histogram[1:])
        if readings[-1] == 0:
            return None
        wanted = [max(1, math.ceil(percent / 100 * readings[-1])) for percent in DEPTH_PERCENTILES]
        units = np.searchsorted(readings, wanted) + 1
        scale = self._sequence.camera.depth_scale
        return {percent: float(unit * scale) for percent, unit in zip(DEPTH_PERCENTILES, units, strict=True)}

    def depth_notes(self) -> list[str]:
        return depth_notes(self._histogram, self._sequence.camera) if self._sequence.has_depth else []

    def missing_share(self) -> float:
        return float(self._histogram[0] / max(1, self._histogram.sum()))


def _gaps(timestamps: Array, steps: Array, longest: float) -> list[Gap]:
    return [Gap(float(timestamps[i]), float(steps[i])) for i in np.flatnonzero(steps > longest)]
