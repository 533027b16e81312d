"""Fig. 11 of Schroeder et al. 2015: reconstruction error against the number of markers."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from depthtrack.benchmarks.papers.experiment import Experiment, ExperimentOptions, PaperComparison
from depthtrack.benchmarks.papers.schroeder2015 import (
    SCHROEDER_2015,
    Search,
    best_model,
    motions_tested,
    quality_of,
    reconstruction_error,
    search_of,
)
from depthtrack.evaluation.sweep.rows import Cell, Row
from depthtrack.hand.shape import HandShape
from depthtrack.markers.layout.manual import MANUAL_BONES, manual_layout
from depthtrack.markers.layout.reconstruction import Method

MARKERS, QUICK_MARKERS = tuple(range(3, 13)), (4, 6, 8)
SPECIFIC = ("grasps", "grasps-2")
METHODS: tuple[Method, ...] = ("subspace", "prior")
KINDS = {"specific": "specific layouts", "generic": "generic layouts", "manual": "manual layouts (Hoyet et al.)"}
PAPER = {"specific": 6, "generic": 9}
"""Markers with which the error falls below 2 mm."""
BELOW_MM = 2.0


def cells(options: ExperimentOptions) -> list[Cell]:
    """Return a cell for each kind of layout, training set, number of markers and method."""
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
            "method": method,
            "search": search_of(options),
        }
        for kind, training, count, layout in chosen
        for test in motions_tested(training)
        for method in METHODS
    ]


def measure(*, kind: str, training: str, markers: int, layout: str, test: str, method: Method, search: Search) -> Row:
    """Return mean and largest error of the vertices, mm."""
    model = manual_layout(layout).on(HandShape()) if layout else best_model(training, markers, search)
    return reconstruction_error(model, quality_of(training, markers).synergies, test, method)._asdict()


def tabulate(rows: Sequence[Row]) -> list[Row]:
    names = ("kind", "training", "markers", "layout", "test", "method", "error_mm", "largest_mm")
    return [{name: row[name] for name in names} for row in rows]


def curve(rows: Sequence[Row], kind: str, method: str) -> dict[int, float]:
    """Return the error, mm, by number of markers; the mean over the test motions."""
    chosen = [row for row in rows if row["kind"] == kind and row["method"] == method]
    counts = sorted({row["markers"] for row in chosen})
    return {n: float(np.mean([row["error_mm"] for row in chosen if row["markers"] == n])) for n in counts}


def fewest_below(errors: dict[int, float]) -> float | None:
    """Return the number of markers from which on all errors are below 2 mm."""
    above = [n for n, error in errors.items() if error >= BELOW_MM]
    later = [n for n in errors if not above or n > max(above)]
    return float(min(later)) if later else None


def compare(rows: Sequence[Row]) -> list[PaperComparison]:
    found = []
    for method in METHODS:
        words = "free refinement" if method == "subspace" else "prior"
        for kind in KINDS:
            errors = curve(rows, kind, method)
            paper = f"{PAPER[kind]}" if kind in PAPER else "as generic"
            found.append(
                PaperComparison(f"{KINDS[kind]}, {words}: below 2 mm from", paper, fewest_below(errors), "markers")
            )
        for kind in ("specific", "generic"):
            errors = curve(rows, kind, method)
            found += [
                PaperComparison(f"{KINDS[kind]}, {words}, {count}", "not given", errors[count], "mm")
                for count in (6, 8)
                if count in errors
            ]
    return found


def draw(axes: Axes, rows: Sequence[Row]) -> None:
    for k, kind in enumerate(KINDS):
        for method, style in zip(METHODS, ("-", ":"), strict=True):
            errors = curve(rows, kind, method)
            words = "" if method == "subspace" else ", with prior"
            axes.plot(
                list(errors), list(errors.values()), style, marker="o", color=f"C{k}", label=f"{KINDS[kind]}{words}"
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
