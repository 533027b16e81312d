"""Table 1 of Schroeder et al. 2015: subspace IK and standard IK from four markers."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from depthtrack.benchmarks.papers.experiment import Experiment, ExperimentOptions, PaperComparison
from depthtrack.benchmarks.papers.schroeder2015 import (
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
from depthtrack.markers.layout.reconstruction import Method

TRAININGS = ("interaction", "interaction-2")
METHODS = {"plain": "standard IK", "subspace": "subspace IK, free refinement", "prior": "least expected error, prior"}
MARKERS = 4
PAPER_CM = {"plain": (1.79, 7.9), "subspace": (0.89, 2.1)}


def cells(options: ExperimentOptions) -> list[Cell]:
    """Return a cell for each training set, seed and method."""
    trainings = TRAININGS if options.synergies is None else (options.synergies,)
    return [
        {"training": training, "test": test, "seed": seed, "method": method, "search": search_of(options)}
        for training in trainings
        for test in motions_tested(training)
        for seed in options.seeds(5, 1)
        for method in METHODS
    ]


def measure(*, training: str, test: str, seed: int, method: Method, search: Search) -> Row:
    """Return mean and largest error of the vertices, mm.

    seed: of the search for the layout.
    """
    system: System = "ours" if method == "prior" else "paper"
    model = best_model(training, MARKERS, system, search, seed)
    error = reconstruction_error(model, quality_of(training, MARKERS, system), test, method, every=1)
    return error._asdict() | {"markers": " ".join(model.labels)}


def tabulate(rows: Sequence[Row]) -> list[Row]:
    names = ("training", "test", "seed", "method", "error_mm", "largest_mm", "markers")
    return [{name: row[name] for name in names} for row in rows]


def _of(rows: Sequence[Row], method: str, name: str) -> list[float]:
    """Return the errors of a method, cm."""
    return [row[name] / 10 for row in rows if row["method"] == method]


def compare(rows: Sequence[Row]) -> list[PaperComparison]:
    found = []
    for method, words in METHODS.items():
        paper = PAPER_CM.get(method)
        mean, largest = ("not in it", "not in it") if paper is None else (f"{paper[0]:g} cm", f"{paper[1]:g} cm")
        found.append(PaperComparison(f"{words}, average", mean, float(np.mean(_of(rows, method, "error_mm"))), "cm"))
        found.append(PaperComparison(f"{words}, maximum", largest, max(_of(rows, method, "largest_mm")), "cm"))
    return found


def draw(axes: Axes, rows: Sequence[Row]) -> None:
    x = np.arange(len(METHODS))
    for offset, name, words in ((-0.2, "error_mm", "average"), (0.2, "largest_mm", "maximum")):
        values = [_of(rows, method, name) for method in METHODS]
        heights = [float(np.mean(v)) if name == "error_mm" else max(v) for v in values]
        axes.bar(x + offset, heights, 0.36, label=f"ours, {words}")
    for k, method in enumerate(METHODS):
        for offset, value in zip((-0.2, 0.2), PAPER_CM.get(method, ()), strict=False):
            label = "paper" if (k, offset) == (0, -0.2) else None
            axes.plot([k + offset - 0.18, k + offset + 0.18], [value] * 2, color="black", linestyle="--", label=label)
    axes.set_xticks(x, list(METHODS.values()))
    axes.set(ylabel="error of the vertices (cm)")
    axes.legend()


EXPERIMENT = Experiment(
    name="schroeder2015-table1",
    title="Reconstruction from four markers",
    source=f"{SCHROEDER_2015}, Table 1",
    cells=cells,
    measure=measure,
    tabulate=tabulate,
    compare=compare,
    draw=draw,
)
