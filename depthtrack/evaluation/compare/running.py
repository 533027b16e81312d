"""One run of a comparison: a contender on a recording with a seed, into its own run folder; goes on where it stood."""

import json
import math
import time
from collections.abc import Sequence as Rows
from contextlib import closing
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import cv2

from depthtrack.evaluation.compare.budget import calibrate
from depthtrack.evaluation.compare.cpu_time import CpuTimed
from depthtrack.evaluation.sweep.rows import Cell, Row
from depthtrack.files import write_atomic
from depthtrack.geometry.camera import Camera
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape, Side
from depthtrack.machine import describe_machine
from depthtrack.recording import open_sequence
from depthtrack.recording.hand_choice import chosen_hand
from depthtrack.recording.run_folder import RunWriter, check_same, read_configuration
from depthtrack.recording.sequence import OnDamage, Sequence
from depthtrack.segmentation.observation import Segmenter
from depthtrack.tracking.configuration import run_configuration
from depthtrack.tracking.pipeline import track_sequence
from depthtrack.tracking.registry import create_tracker

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

    def segmenter(self, sequence: Sequence) -> Segmenter:
        return Segmenter.for_sequence(sequence, None if self.skin_model is None else Path(self.skin_model))

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
    seed: int
    budget: dict[str, Any] | None = field(default=None)

    def to_cell(self) -> Cell:
        return asdict(self)

    @classmethod
    def from_cell(cls, cell: Cell) -> "PlannedRun":
        return cls(**{**cell, "source": Source(**cell["source"])})

    def configuration(self, sequence: Sequence) -> dict[str, Any]:
        """What its run.json tells."""
        source, machine = self.source, describe_machine()
        return run_configuration(
            Path(source.path),
            sequence,
            source.hand_of(sequence),
            self.tracker,
            self.options,
            frames=source.frames,
            skin_model=None if source.skin_model is None else Path(source.skin_model),
            on_damage=source.on_damage,
            threads=1,
            seed=self.seed,
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
        wanted = json.loads(json.dumps(self.configuration(self.source.open())))
        check_same(read_configuration(folder), wanted, folder)
        return "done" if (folder / DONE).exists() else "begun"


def track_cell(cell: Cell) -> Row:
    """Track a planned run to its end, from where it stands; tells how many frames it has now."""
    plan = PlannedRun.from_cell(cell)
    # A run is worth one core: others run beside it.
    cv2.setNumThreads(1)
    sequence = plan.source.open()
    hand = plan.source.hand_of(sequence)
    segmenter = plan.source.segmenter(sequence)
    options = plan.options | {"seed": plan.seed}
    folder = Path(plan.folder)
    with (
        closing(CpuTimed(create_tracker(plan.tracker, hand, **options))) as tracker,
        RunWriter(folder, plan.configuration(sequence), ("segment", *tracker.stages), resume=True) as run,
    ):
        count, clock = plan.source.count(sequence), time.process_time
        rows = track_sequence(sequence, segmenter, tracker, HandModel(hand), run, count=count, clock=clock)
        tracked_now = sum(1 for _ in rows)
        done = {"frames": len(run.rows), "damaged": [asdict(damage) for damage in sequence.damaged]}
    write_atomic(folder / DONE, json.dumps(done) + "\n")
    return {"frames": done["frames"], "tracked_now": tracked_now}


def calibrate_cell(cell: Cell) -> Row:
    """The budget of a contender on a recording: the options chosen, and the CPU milliseconds they took."""
    source = Source(**cell["source"])
    cv2.setNumThreads(1)
    sequence = source.open()
    hand, segmenter = source.hand_of(sequence), source.segmenter(sequence)
    budget = calibrate(sequence, source.count(sequence), segmenter, hand, cell["tracker"], cell["options"], cell["ms"])
    # JSON knows no infinity: no hand was followed anywhere.
    ms = round(budget.ms, 3) if math.isfinite(budget.ms) else None
    return {"chosen": budget.options, "calibrated_ms": ms}


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
