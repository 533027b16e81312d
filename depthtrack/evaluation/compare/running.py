"""One run of a comparison: a contender on a recording with a seed, into its own run folder; goes on where it stood."""

import json
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
from depthtrack.recording.run_folder import check_same, read_configuration, read_rows
from depthtrack.recording.sequence import OnDamage, Sequence
from depthtrack.segmentation.options import SegmentationOptions
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.tracking.configuration import CONFIGURATIONS, TrackerConfig
from depthtrack.tracking.run import TrackingRun, configure
from depthtrack.tracking.run_configuration import RunConfiguration

DONE = "done.json"
"""Stands in a run folder once all of its frames are tracked."""


@dataclass(frozen=True)
class Source:
    """A recording and how to track it.

    `camera`: its own if None.
    `hand`, `side`: see `recording.hand_choice.chosen_hand`.
    `frames`: number of frames; all if None.
    """

    path: str
    camera: dict[str, Any] | None = None
    on_damage: OnDamage = "refuse"
    hand: str | None = None
    skin_model: str | None = None
    frames: int | None = None
    side: Side | None = None

    def open(self) -> Sequence:
        camera = None if self.camera is None else Camera(**self.camera)
        return open_sequence(self.path, camera, self.on_damage)

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
        """Frames to track."""
        return len(sequence) if self.frames is None else min(self.frames, len(sequence))


@dataclass(frozen=True)
class PlannedRun:
    """A run to make in `folder`. `label` of the contender; `budget` tells how equal time was reached, where asked."""

    folder: str
    source: Source
    label: str
    tracker: str
    options: dict[str, Any]
    """Nested options of the tracker, as `options.to_data` gives them."""
    seed: int
    budget: dict[str, Any] | None = field(default=None)

    def to_cell(self) -> Cell:
        return asdict(self)

    @classmethod
    def from_cell(cls, cell: Cell) -> "PlannedRun":
        return cls(**{**cell, "source": Source(**cell["source"])})

    @property
    def config(self) -> TrackerConfig:
        """Configuration of the tracker with this run's seed."""
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
        )
        return configuration.with_context(
            threads=1,
            label=self.label,
            clock="cpu",
            budget=self.budget,
            machine={"cpu": machine.cpu, "cores": machine.cores, "system": machine.system},
        )

    def state(self) -> str:
        """`new`, `begun` or `done`. Raises InputError where the folder holds another run."""
        folder = Path(self.folder)
        if not (folder / "run.json").exists():
            return "new"
        # As JSON would give it back.
        wanted = json.loads(json.dumps(self.configuration(self.source.open()).to_fields()))
        check_same(read_configuration(folder), wanted, folder)
        return "done" if (folder / DONE).exists() else "begun"


def track_cell(cell: Cell) -> Row:
    """Track a planned run to its end, from where it stands; tells how many frames it has now."""
    plan = PlannedRun.from_cell(cell)
    # A run is worth one core: others run beside it.
    cv2.setNumThreads(1)
    sequence, folder = plan.source.open(), Path(plan.folder)
    with TrackingRun(plan.configuration(sequence), sequence, wrap=CpuTimed, clock=time.process_time) as run:
        tracked_now = sum(1 for _ in run.write(folder, resume=True))
        done = {"frames": len(read_rows(folder)), "damaged": [asdict(damage) for damage in sequence.damaged]}
    write_atomic(folder / DONE, json.dumps(done) + "\n")
    return {"frames": done["frames"], "tracked_now": tracked_now}


def calibrate_cell(cell: Cell) -> Row:
    """Return the options that take the given time on a recording, and the CPU milliseconds that they took."""
    source = Source(**cell["source"])
    cv2.setNumThreads(1)
    sequence, config = source.open(), from_data(CONFIGURATIONS[cell["tracker"]], cell["options"], "options")
    hand, segmenter = source.hand_of(sequence), source.segmenter(sequence)
    budget = calibrate(sequence, source.count(sequence), segmenter, hand, config, cell["ms"])
    # JSON has no infinity: no hand was followed anywhere.
    ms = round(budget.ms, 3) if math.isfinite(budget.ms) else None
    return {"chosen": to_data(budget.config), "calibrated_ms": ms}


class FrameCount:
    """Counts the frames that run folders hold, reading only what was written since it was last asked."""

    def __init__(self, folders: Rows[Path]) -> None:
        self._lines = {folder / "poses.csv": 0 for folder in folders}
        self._read = dict.fromkeys(self._lines, 0)

    def __call__(self) -> int:
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
