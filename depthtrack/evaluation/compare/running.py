"""Runs of a comparison: a tracker on a recording with a seed, in its own run folder."""

import math
import time
from collections.abc import Sequence as Rows
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import cv2

from depthtrack.evaluation.compare.budget import calibrate
from depthtrack.evaluation.compare.cpu_time import CpuTimed
from depthtrack.evaluation.sweep.rows import Cell, Row
from depthtrack.files import write_atomic
from depthtrack.geometry.camera import Camera
from depthtrack.hand.shape import HandShape, Side
from depthtrack.machine import describe_machine
from depthtrack.options import from_data, to_data
from depthtrack.recording import open_sequence
from depthtrack.recording.hand_choice import chosen_hand
from depthtrack.recording.keypoints import read_keypoints
from depthtrack.recording.reading import ReadingOptions
from depthtrack.recording.run_continuation import check_same
from depthtrack.recording.run_folder import read_configuration
from depthtrack.recording.run_rows import read_rows
from depthtrack.recording.sequence import OnDamage, Sequence
from depthtrack.segmentation.options import SegmentationOptions
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.strict_data import exact_json_text, parse_json
from depthtrack.tracking.configuration import CONFIGURATIONS, TrackerConfig
from depthtrack.tracking.run import TrackingRun, configure
from depthtrack.tracking.run_configuration import RunConfiguration

DONE = "done.json"
"""File in a run folder that is written after its last frame."""


@dataclass(frozen=True)
class Source:
    """A recording to track, as plain values.

    camera: contents of a `camera.json`; the recording's own if None.
    hand, side: see `recording.hand_choice.chosen_hand`.
    skin_model: path of a skin colour model; published statistics if None.
    frames: number of frames; all if None.
    keypoints: path of a file of keypoints from elsewhere; None for none.
    reading: how the recording is read.
    """

    path: str
    camera: dict[str, Any] | None = None
    on_damage: OnDamage = "refuse"
    hand: str | None = None
    skin_model: str | None = None
    frames: int | None = None
    side: Side | None = None
    keypoints: str | None = None
    reading: ReadingOptions = field(default_factory=ReadingOptions)

    @classmethod
    def from_data(cls, fields: dict[str, Any]) -> "Source":
        """Return the recording of plain nested values."""
        return cls(**{**fields, "reading": ReadingOptions(**fields["reading"])})

    def open(self) -> Sequence:
        """Return the opened recording.

        Raises:
            InputError: if it is unusable.
        """
        camera = None if self.camera is None else Camera(**self.camera)
        return open_sequence(self.path, camera, self.on_damage, self.reading)

    def hand_of(self, sequence: Sequence) -> HandShape:
        """Return the hand to track with."""
        return chosen_hand(sequence, self.hand, self.side)

    @property
    def segmentation(self) -> SegmentationOptions:
        """Options of the segmentation."""
        return SegmentationOptions(skin_model=self.skin_model)

    def segmenter(self, sequence: Sequence) -> Segmenter:
        """Return a segmenter for the opened recording."""
        return Segmenter.for_sequence(sequence, self.segmentation)

    def count(self, sequence: Sequence) -> int:
        """Return the number of frames to track."""
        return len(sequence) if self.frames is None else min(self.frames, len(sequence))


@dataclass(frozen=True)
class PlannedRun:
    """A run to make, as plain values.

    folder: path of the run folder.
    label: label of the tracker.
    tracker: name of the tracker.
    options: nested options of the tracker, as `options.to_data` returns them.
    budget: given and measured milliseconds at equal time; None otherwise.
    """

    folder: str
    source: Source
    label: str
    tracker: str
    options: dict[str, Any]
    seed: int
    budget: dict[str, Any] | None = None

    def to_cell(self) -> Cell:
        """Return the run as a cell of a sweep."""
        return asdict(self)

    @classmethod
    def from_cell(cls, cell: Cell) -> "PlannedRun":
        """Return the run of a cell."""
        return cls(**{**cell, "source": Source.from_data(cell["source"])})

    @property
    def config(self) -> TrackerConfig:
        """Configuration of the tracker with the seed of this run."""
        return replace(from_data(CONFIGURATIONS[self.tracker], self.options, "options"), seed=self.seed)

    def configuration(self, sequence: Sequence) -> RunConfiguration:
        """Return the configuration of the run."""
        source, machine = self.source, describe_machine()
        configuration = configure(
            Path(source.path),
            sequence,
            self.config,
            source.hand_of(sequence),
            source.segmentation,
            frames=source.frames,
            on_damage=source.on_damage,
            keypoints=source.keypoints,
        )
        return configuration.with_context(
            threads=1,
            label=self.label,
            clock="cpu",
            budget=self.budget,
            machine={"cpu": machine.cpu, "cores": machine.cores, "system": machine.system},
        )

    def state(self) -> str:
        """Return `new`, `begun` or `done`.

        Raises:
            InputError: if the folder contains another run.
        """
        folder = Path(self.folder)
        if not (folder / "run.json").exists():
            return "new"
        # The round trip turns tuples into lists, as in the stored file.
        expected = parse_json(exact_json_text(self.configuration(self.source.open()).to_fields()))
        check_same(read_configuration(folder), expected, folder)
        return "done" if (folder / DONE).exists() else "begun"


def track_cell(cell: Cell) -> Row:
    """Track a planned run from its last frame to its end; return the number of its frames."""
    plan = PlannedRun.from_cell(cell)
    # Other runs use the other cores.
    cv2.setNumThreads(1)
    sequence, folder = plan.source.open(), Path(plan.folder)
    with TrackingRun(plan.configuration(sequence), sequence, wrap=CpuTimed, clock=time.process_time, ahead=0) as run:
        tracked_now = sum(1 for _ in run.write(folder, resume=True))
        done = {"frames": len(read_rows(folder)), "damaged": [asdict(damage) for damage in sequence.damaged]}
    write_atomic(folder / DONE, exact_json_text(done) + "\n")
    return {"frames": done["frames"], "tracked_now": tracked_now}


def calibrate_cell(cell: Cell) -> Row:
    """Return the options that take the given time on a recording, and their CPU milliseconds."""
    source = Source.from_data(cell["source"])
    cv2.setNumThreads(1)
    sequence, config = source.open(), from_data(CONFIGURATIONS[cell["tracker"]], cell["options"], "options")
    hand, segmenter = source.hand_of(sequence), source.segmenter(sequence)
    keypoints = None if source.keypoints is None else read_keypoints(Path(source.keypoints))
    budget = calibrate(sequence, source.count(sequence), segmenter, hand, config, cell["ms"], keypoints)
    # JSON has no NaN, which stands for a hand that was found nowhere.
    ms = round(budget.ms, 3) if math.isfinite(budget.ms) else None
    return {"chosen": to_data(budget.config), "calibrated_ms": ms}


class FrameCount:
    """Count the frames in run folders; each call reads only the new rows."""

    def __init__(self, folders: Rows[Path]) -> None:
        self._lines = {folder / "poses.csv": 0 for folder in folders}
        self._read = dict.fromkeys(self._lines, 0)

    def __call__(self) -> int:
        """Return the number of frames."""
        for path, read in self._read.items():
            try:
                if path.stat().st_size <= read:
                    continue
                with path.open("rb") as file:
                    file.seek(read)
                    while block := file.read(1 << 20):
                        self._lines[path] += block.count(b"\n")
                        self._read[path] += len(block)
            except OSError:
                continue
        return sum(max(0, lines - 1) for lines in self._lines.values())
