"""Fig. 11 of Schroeder et al. 2015: reconstruction error against the number of markers."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from depthtrack.benchmarks.papers.experiment import Experiment, ExperimentOptions, PaperComparison
from depthtrack.benchmarks.papers.schroeder2015 import (
    METHOD,
    SCHROEDER_2015,
    Search,
    System,
    best_model,
    motions_tested,
    quality_of,
    reconstruction_error,
    search_of,
)
from depthtrack.evaluation.sweep.rows import Cell, Row
from depthtrack.hand.shape import HandShape
from depthtrack.markers.layout.manual import MANUAL_BONES, manual_layout

MARKERS, QUICK_MARKERS = tuple(range(3, 13)), (4, 6, 8)
SPECIFIC = ("grasps", "grasps-2")
SYSTEMS = {"paper": "free refinement", "ours": "prior"}
KINDS = {"specific": "specific layouts", "generic": "generic layouts", "manual": "manual layouts (Hoyet)"}
PAPER = {"specific": 6, "generic": 9}
"""Markers with which the error falls below 2 mm."""
BELOW_MM = 2.0


def cells(options: ExperimentOptions) -> list[Cell]:
    """Return a cell for each kind of layout, training set, number of markers and system."""
    counts = QUICK_MARKERS if options.quick else MARKERS
    generic = options.synergies or "generic"
    trainings = [("specific", name) for name in SPECIFIC] + [("generic", generic)]
    chosen = [(kind, training, count, "") for kind, training in trainings for count in counts]
    chosen += [
        ("manual", generic, len(bones), name)
        for name, bones in MANUAL_BONES.items()
        if not options.quick or len(bones) in counts
    ]
    return [
        {
            "kind": kind,
            "training": training,
            "markers": count,
            "layout": layout,
            "test": test,
            "system": system,
            "search": search_of(options),
        }
        for kind, training, count, layout in chosen
        for test in motions_tested(training)
        for system in SYSTEMS
    ]


def measure(*, kind: str, training: str, markers: int, layout: str, test: str, system: System, search: Search) -> Row:
    """Return mean and largest error of the vertices, mm."""
    model = manual_layout(layout).on(HandShape()) if layout else best_model(training, markers, system, search)
    return reconstruction_error(model, quality_of(training, markers, system), test, METHOD[system])._asdict()


def tabulate(rows: Sequence[Row]) -> list[Row]:
    names = ("kind", "training", "markers", "layout", "test", "system", "error_mm", "largest_mm")
    return [{name: row[name] for name in names} for row in rows]


def curve(rows: Sequence[Row], kind: str, system: str) -> dict[int, float]:
    """Return the error, mm, by number of markers; the mean over the test motions."""
    chosen = [row for row in rows if (row["kind"], row["system"]) == (kind, system)]
    counts = sorted({row["markers"] for row in chosen})
    return {n: float(np.mean([row["error_mm"] for row in chosen if row["markers"] == n])) for n in counts}


def fewest_below(errors: dict[int, float]) -> float | None:
    """Return the number of markers from which on all errors are below 2 mm."""
    above = [n for n, error in errors.items() if error >= BELOW_MM]
    later = [n for n in errors if not above or n > max(above)]
    return float(min(later)) if later else None


def compare(rows: Sequence[Row]) -> list[PaperComparison]:
    found = []
    for system, words in SYSTEMS.items():
        for kind in KINDS:
            errors = curve(rows, kind, system)
            paper = f"{PAPER[kind]}" if kind in PAPER else "as generic"
            found.append(
                PaperComparison(f"{KINDS[kind]}, {words}: below 2 mm from", paper, fewest_below(errors), "markers")
            )
        for kind in ("specific", "generic"):
            errors = curve(rows, kind, system)
            found += [
                PaperComparison(f"{KINDS[kind]}, {words}, {count}", "not given", errors[count], "mm")
                for count in (6, 8)
                if count in errors
            ]
    return found


def draw(axes: Axes, rows: Sequence[Row]) -> None:
    for k, kind in enumerate(KINDS):
        for (system, words), style in zip(SYSTEMS.items(), (":", "-"), strict=True):
            errors = curve(rows, kind, system)
            axes.plot(
                list(errors), list(errors.values()), style, marker="o", color=f"C{k}", label=f"{KINDS[kind]}, {words}"
            )
    for k, (kind, count) in enumerate(PAPER.items()):
        axes.plot(count, BELOW_MM, "D", color=f"C{k}", mec="black", ms=7, label=f"paper, {kind}")
    axes.axhline(BELOW_MM, color="0.5", linestyle="--")
    axes.set(xlabel="markers", ylabel="error of the vertices (mm)", ylim=(0, None))
    axes.legend(fontsize=8)


EXPERIMENT = Experiment(
    name="schroeder2015-11",
    title="Reconstruction error of specific, generic and manual layouts",
    source=f"{SCHROEDER_2015}, Fig. 11",
    cells=cells,
    measure=measure,
    tabulate=tabulate,
    compare=compare,
    draw=draw,
)
