"""The cross-model benchmark: hands that the trackers do not know, calibrated and tracked."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from depthtrack.benchmarks.crossmodel.measure import TRACKERS, measure
from depthtrack.benchmarks.crossmodel.recordings import recording_cells
from depthtrack.benchmarks.papers.experiment import Experiment, PaperComparison
from depthtrack.evaluation.sweep.rows import Row


def tabulate(rows: Sequence[Row]) -> list[Row]:
    """Return one line per tracker: means over the recordings, and the worst one."""
    return [
        {
            "tracker": name,
            "recordings": len(rows),
            **{key: _mean(rows, f"{name}_{key}") for key in ("mean_mm", "raw_mm", "p95_mm", "visible_mm", "hidden_mm")},
            "worst_mean_mm": _worst(rows, f"{name}_mean_mm"),
            "untrusted_percent": _mean(rows, f"{name}_untrusted_percent"),
            "wrong_percent": _mean(rows, f"{name}_wrong_percent"),
            "longest_wrong_s": max(row[f"{name}_longest_wrong_s"] for row in rows),
        }
        for name in TRACKERS
    ]


def compare(rows: Sequence[Row]) -> list[PaperComparison]:
    """Return the figures beside their goals."""
    sure = [row for row in rows if row["side_sure"]]
    return [
        PaperComparison("sides that are called sure", "80 %", 100 * len(sure) / len(rows), "%"),
        PaperComparison("right sides among those", "100 %", _share(sure, "side_right"), "%"),
        PaperComparison("right sides among all", "", _share(rows, "side_right"), "%"),
        PaperComparison("starts of open hands on the right branch", "97 %", _ratio(rows, "open_starts"), "%"),
        PaperComparison("starts on the right branch", "90 %", _ratio(rows, "starts"), "%"),
        PaperComparison("palms taken for backs that are corrected in 1 s", "", _exchanged(rows), "%"),
        *(
            PaperComparison(f"{name}: {what}", goal, value, unit)
            for name, line in ((each["tracker"], each) for each in tabulate(rows))
            for what, goal, value, unit in (
                ("mean error after offsets", "2.5 mm", line["mean_mm"], "mm"),
                ("95th percentile of frames", "8 mm", line["p95_mm"], "mm"),
                ("longest wrong branch", "0.5 s", line["longest_wrong_s"], "s"),
            )
        ),
    ]


def draw(axes: Axes, rows: Sequence[Row]) -> None:
    """Plot the sorted mean errors of the recordings."""
    for name in TRACKERS:
        errors = sorted(row[f"{name}_mean_mm"] for row in rows if row[f"{name}_mean_mm"] is not None)
        axes.plot(np.linspace(0, 100, len(errors)), errors, marker="o", label=name)
    axes.set(xlabel="recordings (%)", ylabel="mean joint error after offsets (mm)", yscale="log")
    axes.legend()


def _mean(rows: Sequence[Row], key: str) -> float | None:
    values = [row[key] for row in rows if row[key] is not None]
    return float(np.mean(values)) if values else None


def _worst(rows: Sequence[Row], key: str) -> float | None:
    return max((row[key] for row in rows if row[key] is not None), default=None)


def _share(rows: Sequence[Row], key: str) -> float | None:
    return 100 * float(np.mean([row[key] for row in rows])) if rows else None


def _exchanged(rows: Sequence[Row]) -> float | None:
    total = sum(row["exchanged"] for row in rows)
    return 100 * sum(row["exchanged_corrected"] for row in rows) / total if total else None


def _ratio(rows: Sequence[Row], key: str) -> float | None:
    total: Any = sum(row[key] for row in rows)
    return 100 * float(sum(row[f"{key}_right"] for row in rows) / total) if total else None


EXPERIMENT = Experiment(
    name="crossmodel",
    title="Hands of another make or of unknown sizes",
    source="calibrated on the recording itself, automatic start",
    cells=recording_cells,
    measure=measure,
    tabulate=tabulate,
    compare=compare,
    draw=draw,
    reference="goal",
)
