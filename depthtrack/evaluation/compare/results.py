"""Results of a comparison: per run as CSV and JSON, per tracker and recording as a table."""

import csv
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
from depthtrack.strict_data import json_text
from depthtrack.text_table import aligned

TRUTH_METRICS = ("endpoint_error_mm", "joint_error_mm")
"""Mean errors of phalanx endpoints relative to true poses, or of joints relative to annotated ones."""

TRACKER_MS = "tracker_ms"
"""Name of the time without segmentation."""


@dataclass(frozen=True)
class TrackerResult:
    """Result of a tracker on a recording: medians over runs that differ in their seeds.

    recording: name of the recording.
    label: label of the tracker.
    evaluations: evaluations of the runs.
    """

    recording: str
    label: str
    evaluations: tuple[Evaluation, ...]

    def figure(self, metric: str, statistic: str) -> float | None:
        """Return the median over the runs of a statistic of a metric; None if it is unavailable."""
        found = [figures_of(evaluation).get(metric) for evaluation in self.evaluations]
        known = [metric.statistics().get(statistic) for metric in found if metric is not None]
        numbers = [number for number in known if number is not None]
        return float(np.median(numbers)) if numbers else None

    @property
    def truth(self) -> str | None:
        """The one of TRUTH_METRICS that the recording allows; None without ground truth."""
        return next((name for name in TRUTH_METRICS if self.figure(name, "mean") is not None), None)

    def error(self, statistic: str) -> float | None:
        """Return a statistic of the error in `truth`, mm; None without ground truth."""
        return None if self.truth is None else self.figure(self.truth, statistic)

    def within(self, threshold_mm: float) -> float | None:
        """Return the median over the runs of the share of frames with a largest error below."""
        shares = [e.success.within(threshold_mm) for e in self.evaluations if e.success is not None]
        return float(np.median(shares)) if shares else None

    @property
    def auc(self) -> float | None:
        """Median over the runs of the area under the success curve; None without ground truth."""
        areas = [e.success.auc for e in self.evaluations if e.success is not None]
        return float(np.median(areas)) if areas else None

    @property
    def source(self) -> str:
        """Path of the recording, which is unique unlike its name."""
        return self.evaluations[0].configuration.sequence

    @property
    def frames(self) -> int:
        """Number of frames of all runs."""
        return sum(evaluation.frames for evaluation in self.evaluations)

    @property
    def lost(self) -> int:
        """Number of frames of all runs with an observed hand but without a trusted pose."""
        return sum(int(evaluation.losses.lost.sum()) for evaluation in self.evaluations)


def evaluate_runs(folders: Sequence[Path], workers: Workers) -> Iterator[Evaluation]:
    """Yield the evaluations of run folders in their order.

    Raises:
        SweepError: if a run is unusable.
    """
    found: dict[int, Evaluation] = {}
    following = 0
    for number, row in workers.measure(evaluate_cell, [{"run": str(folder)} for folder in folders]):
        found[number] = row["evaluation"]
        while following in found:
            yield found.pop(following)
            following += 1


def evaluate_cell(cell: Cell) -> Row:
    """Return the evaluation of one run folder, as a cell of a sweep."""
    return {"evaluation": evaluate_run(Path(cell["run"]))}


def figures_of(evaluation: Evaluation) -> dict[str, Metric]:
    """Return all metrics of a run by name, including its times."""
    times = (evaluation.ms_per_frame, _tracker_time(evaluation))
    return {metric.name: metric for metric in (*evaluation.metrics, *times)}


def _tracker_time(evaluation: Evaluation) -> Metric:
    """Return the time of tracked frames without segmentation, which a budget limits, ms."""
    stages = [metric.values for stage, metric in evaluation.stage_ms.items() if stage != "segment"]
    total = np.sum(stages, axis=0) if stages else np.full(evaluation.frames, np.nan)
    tracked = np.array([status is Status.TRACKED for status in evaluation.run.status], dtype=np.bool_)
    return Metric(TRACKER_MS, "ms", np.where(tracked, total, np.nan))


def label_of(evaluation: Evaluation) -> str:
    """Return the label of a run's tracker: that of its comparison, else name and options."""
    label = evaluation.configuration.context.get("label")
    return label if isinstance(label, str) and label else tracker_label(evaluation.configuration.tracker)


def tracker_results(evaluations: Sequence[Evaluation]) -> list[TrackerResult]:
    """Return one result per recording and tracker, in the order of their first runs.

    Runs with one label and different seeds are repetitions. Other runs get a result each, with the name of their
    folder in the label.
    """
    groups: dict[tuple[str, str], list[Evaluation]] = {}
    for evaluation in evaluations:
        key = (evaluation.configuration.sequence, label_of(evaluation))
        groups.setdefault(key, []).append(evaluation)
    recordings = list(dict.fromkeys(path for path, _ in groups))
    results = []
    for (_, label), runs in sorted(groups.items(), key=lambda group: recordings.index(group[0][0])):
        if len({run.configuration.tracker.seed for run in runs}) == len(runs):
            results.append(TrackerResult(runs[0].recording, label, tuple(runs)))
        else:
            results += [TrackerResult(run.recording, f"{label}, {run.run.folder.name}", (run,)) for run in runs]
    return results


def write_results(evaluations: Sequence[Evaluation], folder: Path) -> None:
    """Write `results.json` with one object per run, and `results.csv` with the same in columns."""
    rows = [run_record(evaluation) for evaluation in evaluations]
    write_atomic(folder / "results.json", json_text(rows, indent=2) + "\n")
    flat = [dict(_flat(row)) for row in rows]
    columns = list(dict.fromkeys(name for row in flat for name in row))
    text = StringIO()
    writer = csv.DictWriter(text, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(flat)
    write_atomic(folder / "results.csv", text.getvalue())


def run_record(evaluation: Evaluation) -> dict[str, Any]:
    """Return label, seed, statistics, clock and budget of a run as JSON values."""
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
    """Column of the table of a comparison.

    form: format of the numbers.
    value: returns the number of a result; None if it is unknown.
    """

    heading: str
    unit: str
    form: str
    value: Callable[[TrackerResult], float | None]
    higher_is_better: bool = False


COLUMNS = (
    Column("error mean", "mm", ".2f", lambda result: result.error("mean")),
    Column("median", "mm", ".2f", lambda result: result.error("median")),
    Column("p95", "mm", ".2f", lambda result: result.error("p95")),
    Column("angles", "deg", ".2f", lambda result: result.figure("angle_error_deg", "mean")),
    Column("< 20 mm", "frames", ".1%", lambda result: result.within(20), higher_is_better=True),
    Column("E3D", "mm", ".2f", lambda result: result.figure("e3d_mm", "median")),
    Column("IoU", "", ".3f", lambda result: result.figure("silhouette_iou", "median"), higher_is_better=True),
    Column("jitter", "mm", ".2f", lambda result: result.figure("jitter_mm", "median")),
    Column("lost", "frames", ".0f", lambda result: float(result.lost)),
    Column("time", "ms", ".1f", lambda result: result.figure("ms_per_frame", "median")),
    Column("tracker alone", "ms", ".1f", lambda result: result.figure(TRACKER_MS, "median")),
)


def shown_columns(results: Sequence[TrackerResult]) -> list[Column]:
    """Return the columns with a number in any of the results."""
    return [column for column in COLUMNS if any(column.value(result) is not None for result in results)]


def as_table(results: Sequence[TrackerResult]) -> str:
    """Return the results as aligned lines; columns without a number are left out."""
    columns = shown_columns(results)
    head = ["recording", "tracker", "frames", *(f"{c.heading} {c.unit}".strip() for c in columns)]
    rows = [
        [result.recording, result.label, str(result.frames), *(_cell(c.value(result), c.form) for c in columns)]
        for result in results
    ]
    return "\n".join(aligned([head, *rows], left=2))


def _cell(value: float | None, form: str) -> str:
    return "-" if value is None else format(value, form)


def _flat(value: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the columns of nested objects; their keys are joined by underscores."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _flat(inner, f"{name}_{key}" if name else key)
    else:
        yield name, value
