"""What came of a comparison: a row a run, a line a tracker and recording, as CSV, as JSON, and for a terminal."""

import csv
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from depthtrack.evaluation.compare.specs import label_of as tracker_label
from depthtrack.evaluation.evaluate import Evaluation, evaluate_run
from depthtrack.evaluation.metrics import Metric
from depthtrack.evaluation.sweep.rows import Cell, Row
from depthtrack.evaluation.sweep.run import Workers
from depthtrack.files import write_atomic
from depthtrack.recording.status import Status
from depthtrack.text_table import aligned

TRUTH_METRICS = ("endpoint_error_mm", "joint_error_mm")
"""Errors against a truth: of the phalanx endpoints of true poses, or of annotated joints."""

TRACKER_MS = "tracker_ms"


@dataclass(frozen=True)
class TrackerResult:
    """A tracker on a recording: its runs, which differ in their seeds, and the medians of their figures."""

    recording: str
    label: str
    evaluations: tuple[Evaluation, ...]

    def figure(self, metric: str, statistic: str) -> float | None:
        """The median over the runs of a metric's statistic; None where the recording does not allow it."""
        found = [figures_of(evaluation).get(metric) for evaluation in self.evaluations]
        known = [metric.statistics().get(statistic) for metric in found if metric is not None]
        numbers = [number for number in known if number is not None]
        return float(np.median(numbers)) if numbers else None

    @property
    def truth(self) -> str | None:
        """Which of TRUTH_METRICS the recording allows."""
        return next((name for name in TRUTH_METRICS if self.figure(name, "mean") is not None), None)

    def error(self, statistic: str) -> float | None:
        """A statistic of the error against the truth there is, mm."""
        return None if self.truth is None else self.figure(self.truth, statistic)

    def within(self, threshold_mm: float) -> float | None:
        """The median over the runs of the share of frames whose largest error is under a threshold."""
        shares = [e.success.within(threshold_mm) for e in self.evaluations if e.success is not None]
        return float(np.median(shares)) if shares else None

    @property
    def auc(self) -> float | None:
        """The median over the runs of the area under the curve of those shares."""
        areas = [e.success.auc for e in self.evaluations if e.success is not None]
        return float(np.median(areas)) if areas else None

    @property
    def source(self) -> str:
        """Where the recording was, which tells recordings of one name apart."""
        return self.evaluations[0].configuration.sequence

    @property
    def frames(self) -> int:
        """Frames of all runs."""
        return sum(evaluation.frames for evaluation in self.evaluations)

    @property
    def lost(self) -> int:
        """Frames of all runs without a trusted pose although a hand was observed."""
        return sum(int(evaluation.losses.lost.sum()) for evaluation in self.evaluations)


def evaluate_runs(folders: Sequence[Path], workers: Workers) -> Iterator[Evaluation]:
    """Evaluate run folders, in their order, wherever the workers are."""
    found: dict[int, Evaluation] = {}
    following = 0
    for number, row in workers.measure(evaluate_cell, [{"run": str(folder)} for folder in folders]):
        found[number] = row["evaluation"]
        while following in found:
            yield found.pop(following)
            following += 1


def evaluate_cell(cell: Cell) -> Row:
    """Evaluate one run folder."""
    return {"evaluation": evaluate_run(Path(cell["run"]))}


def figures_of(evaluation: Evaluation) -> dict[str, Metric]:
    """All of a run's figures a frame by name, with its times."""
    times = (evaluation.ms_per_frame, _tracker_time(evaluation))
    return {metric.name: metric for metric in (*evaluation.metrics, *times)}


def _tracker_time(evaluation: Evaluation) -> Metric:
    """Milliseconds of followed frames without segmentation: what a tracker's budget is about."""
    stages = [metric.values for stage, metric in evaluation.stage_ms.items() if stage != "segment"]
    total = np.sum(stages, axis=0) if stages else np.full(evaluation.frames, np.nan)
    followed = np.array([status is Status.TRACKED for status in evaluation.run.status], dtype=np.bool_)
    return Metric(TRACKER_MS, "ms", np.where(followed, total, np.nan))


def label_of(evaluation: Evaluation) -> str:
    """Return the label of a run's tracker: that of its comparison, else its name and the options that it changes."""
    label = evaluation.configuration.context.get("label")
    return label if isinstance(label, str) and label else tracker_label(evaluation.configuration.tracker)


def tracker_results(evaluations: Sequence[Evaluation]) -> list[TrackerResult]:
    """A line for every recording and tracker, in the order in which they first come.

    Runs of one label that have different seeds are repetitions; others are lines of their own, under their folders'
    names too.
    """
    groups: dict[tuple[str, str], list[Evaluation]] = {}
    for evaluation in evaluations:
        key = (evaluation.configuration.sequence, label_of(evaluation))
        groups.setdefault(key, []).append(evaluation)
    recordings = list(dict.fromkeys(path for path, _ in groups))
    lines = []
    for (_, label), runs in sorted(groups.items(), key=lambda group: recordings.index(group[0][0])):
        if len({run.configuration.tracker.seed for run in runs}) == len(runs):
            lines.append(TrackerResult(runs[0].recording, label, tuple(runs)))
        else:
            lines += [TrackerResult(run.recording, f"{label}, {run.run.folder.name}", (run,)) for run in runs]
    return lines


def write_results(evaluations: Sequence[Evaluation], folder: Path) -> None:
    """Write `results.json`, an object a run, and `results.csv`, the same in columns."""
    rows = [run_record(evaluation) for evaluation in evaluations]
    write_atomic(folder / "results.json", json.dumps(rows, indent=2) + "\n")
    flat = [dict(_flat(row)) for row in rows]
    columns = list(dict.fromkeys(name for row in flat for name in row))
    text = StringIO()
    writer = csv.DictWriter(text, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(flat)
    write_atomic(folder / "results.csv", text.getvalue())


def run_record(evaluation: Evaluation) -> dict[str, Any]:
    """All figures of a run, under the names that tell it from others."""
    context = evaluation.configuration.context
    return {
        "label": label_of(evaluation),
        "seed": evaluation.configuration.tracker.seed,
        **evaluation.to_json(),
        TRACKER_MS: _tracker_time(evaluation).statistics(),
        "clock": context.get("clock", "wall"),
        "budget": context.get("budget"),
    }


@dataclass(frozen=True)
class Column:
    """A column of the comparison's table: its heading, unit, format, and the figure of a line (None: not known)."""

    heading: str
    unit: str
    form: str
    value: Callable[[TrackerResult], float | None]
    higher_is_better: bool = False


COLUMNS = (
    Column("error mean", "mm", ".2f", lambda line: line.error("mean")),
    Column("median", "mm", ".2f", lambda line: line.error("median")),
    Column("p95", "mm", ".2f", lambda line: line.error("p95")),
    Column("angles", "deg", ".2f", lambda line: line.figure("angle_error_deg", "mean")),
    Column("< 20 mm", "frames", ".1%", lambda line: line.within(20), higher_is_better=True),
    Column("E3D", "mm", ".2f", lambda line: line.figure("e3d_mm", "median")),
    Column("IoU", "", ".3f", lambda line: line.figure("silhouette_iou", "median"), higher_is_better=True),
    Column("jitter", "mm", ".2f", lambda line: line.figure("jitter_mm", "median")),
    Column("lost", "frames", ".0f", lambda line: float(line.lost)),
    Column("time", "ms", ".1f", lambda line: line.figure("ms_per_frame", "median")),
    Column("tracker alone", "ms", ".1f", lambda line: line.figure(TRACKER_MS, "median")),
)


def shown_columns(lines: Sequence[TrackerResult]) -> list[Column]:
    """The columns that any of the lines has a figure for."""
    return [column for column in COLUMNS if any(column.value(line) is not None for line in lines)]


def as_table(lines: Sequence[TrackerResult]) -> str:
    """The comparison for a terminal; columns that no recording allows are left out."""
    columns = shown_columns(lines)
    head = ["recording", "tracker", "frames", *(f"{c.heading} {c.unit}".strip() for c in columns)]
    rows = [
        [line.recording, line.label, str(line.frames), *(_cell(c.value(line), c.form) for c in columns)]
        for line in lines
    ]
    return "\n".join(aligned([head, *rows], left=2))


def _cell(value: float | None, form: str) -> str:
    return "-" if value is None else format(value, form)


def _flat(value: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """Nested objects as columns: their keys joined by underscores."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _flat(inner, f"{name}_{key}" if name else key)
    else:
        yield name, value
