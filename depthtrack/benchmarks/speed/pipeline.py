"""`depthtrack bench pipeline`: measure trackers from the reading of a file to the pose.

Frames are read ahead in a thread, as in `depthtrack track`. The time of a frame is that between two poses. The first
frame, with its search for the hand, does not count; a run of a few frames before compiles the kernels.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Literal

import numpy as np

from depthtrack.errors import InputError
from depthtrack.hand.shape import HandShape
from depthtrack.machine import Machine, describe_machine
from depthtrack.recording import sequence as recordings
from depthtrack.recording.hand_choice import chosen_hand
from depthtrack.text_table import aligned
from depthtrack.tracking.configuration import HybridConfig, IkConfig, TrackerConfig
from depthtrack.tracking.registry import tracker_config
from depthtrack.tracking.run import TrackingRun, configure
from depthtrack.types import Array

WHOLE, READ = "whole", "read"
"""Stages: from one pose to the next, and reading and decoding a frame without reading ahead."""
_WARM = 3
"""Frames of the run that compiles the kernels."""


@dataclass(frozen=True)
class StageRow:
    """Time of a stage of a tracker over the frames after the first one, milliseconds.

    frames_per_s: of wall-clock time; of the whole alone.
    """

    tracker: str
    threads: int
    stage: str
    frames: int
    median_ms: float
    mean_ms: float
    p95_ms: float
    max_ms: float
    frames_per_s: float | None = None


@dataclass(frozen=True)
class PipelineReport:
    """Report of `bench pipeline`.

    machine: the machine before the measurements.
    """

    benchmark: Literal["pipeline"]
    machine: Machine
    recording: str
    rows: list[StageRow]


@dataclass(frozen=True)
class PipelinePlan:
    """Plan of a measurement: each tracker over the first `frames` frames of a recording."""

    path: Path
    sequence: recordings.Sequence
    hand: HandShape
    trackers: Sequence[TrackerConfig]
    frames: int
    threads: int

    @property
    def row_count(self) -> None:
        """Number of rows, which the stages decide."""
        return None


def plan(
    path: Path,
    sequence: recordings.Sequence,
    trackers: Sequence[str],
    hand: str | None,
    frames: int | None,
    threads: int,
    deadline: float | None,
) -> PipelinePlan:
    """Return a plan for a recording.

    path: where the recording was read.
    hand: as in `recording.hand_choice.chosen_hand`; None for the recording's own, or the average one.
    frames: number of frames, None for all.
    deadline: of the trackers that have one, milliseconds.

    Raises:
        InputError: if the recording has less than two frames, or there is no such tracker.
    """
    count = len(sequence) if frames is None else min(frames, len(sequence))
    if count < 2:
        raise InputError(f"{path} must have at least two frames, found {count}: give a longer recording")
    named = ("truth" if sequence.hand is not None else "average") if hand is None else hand
    configs = [_with_deadline(tracker_config(name), deadline) for name in trackers]
    return PipelinePlan(path, sequence, chosen_hand(sequence, named), configs, count, threads)


def run(plan: PipelinePlan, progress: Callable[[Iterator[StageRow]], Iterable[StageRow]] = iter) -> PipelineReport:
    """Return the measurements of a plan.

    progress: wraps the rows, as a progress bar does.
    """
    machine = describe_machine()
    rows = (row for config in plan.trackers for row in measure(plan, config))
    return PipelineReport("pipeline", machine, plan.sequence.name, list(progress(rows)))


def measure(plan: PipelinePlan, config: TrackerConfig) -> Iterator[StageRow]:
    """Yield the rows of a tracker: the whole, reading, and each of its stages."""
    _times(plan, config, min(_WARM, plan.frames))
    whole, stages = _times(plan, config, plan.frames)
    rate = 1e3 * len(whole) / whole.sum()
    yield _row(plan, config, WHOLE, whole, rate)
    yield _row(plan, config, READ, _reading_times(plan))
    for stage, times in stages.items():
        if times.any():
            yield _row(plan, config, stage, times)


def _times(plan: PipelinePlan, config: TrackerConfig, frames: int) -> tuple[Array, dict[str, Array]]:
    """Return milliseconds (N - 1,) from pose to pose, and of each stage."""
    configuration = configure(plan.path, plan.sequence, config, plan.hand, frames=frames)
    ends, stages = [], list[dict[str, float]]()
    with closing(TrackingRun(configuration, plan.sequence, plan.threads)) as tracking:
        for each in tracking.track():
            ends.append(perf_counter())
            stages.append({"segment": each.segment_ms, **each.estimate.stage_ms})
    names = dict.fromkeys(name for times in stages for name in times)
    return 1e3 * np.diff(ends), {name: np.array([times.get(name, 0.0) for times in stages[1:]]) for name in names}


def _reading_times(plan: PipelinePlan) -> Array:
    """Return milliseconds (N - 1,) to read each frame."""
    ends = [perf_counter() for _ in plan.sequence.frames(range(plan.frames))]
    return 1e3 * np.diff(ends)


def _row(plan: PipelinePlan, config: TrackerConfig, stage: str, ms: Array, rate: float | None = None) -> StageRow:
    median, p95 = np.percentile(ms, (50, 95))
    return StageRow(
        config.name, plan.threads, stage, len(ms), float(median), float(ms.mean()), float(p95), float(ms.max()), rate
    )


def _with_deadline(config: TrackerConfig, deadline: float | None) -> TrackerConfig:
    if deadline is None or not isinstance(config, HybridConfig | IkConfig):
        return config
    return tracker_config(config.name, deadline=deadline)


def as_text(report: PipelineReport) -> str:
    """Return the report as text: the machine, and a row for each stage of each tracker."""
    head = ("tracker", "stage", "median", "mean", "p95", "max", "frames/s")
    lines = [
        (
            row.tracker if row.stage == WHOLE else "",
            row.stage,
            *(f"{ms:.2f}" for ms in (row.median_ms, row.mean_ms, row.p95_ms, row.max_ms)),
            "" if row.frames_per_s is None else f"{row.frames_per_s:.0f}",
        )
        for row in report.rows
    ]
    threads = report.rows[0].threads if report.rows else 0
    return "\n".join(
        [
            report.machine.headline,
            f"{report.recording}, {threads} threads, milliseconds a frame after the first one",
            "",
            *aligned([head, *lines], left=2),
            "",
            "whole: from one pose to the next, frames read ahead; read: reading and decoding alone",
        ]
    )
