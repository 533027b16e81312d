"""Fig. 10 of Schroeder et al. 2015: our layouts and those of Wheatland et al. 2013."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from depthtrack.benchmarks.papers.experiment import Experiment, ExperimentOptions, PaperComparison
from depthtrack.benchmarks.papers.plot import plain_log_scale
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
    training_postures,
)
from depthtrack.evaluation.sweep.rows import Cell, Row
from depthtrack.markers.layout.wheatland import random_base, wheatland_layout

MARKERS, QUICK_MARKERS = tuple(range(4, 13)), (4, 6, 8)
TRAININGS = ("grasps", "grasps-2")
BASES = {"all": "all vertices", "three": "three a bone", "one": "one a bone"}
"""Base marker sets (a) to (c) of the figure."""
SYSTEMS = {"paper": "paper's objective", "ours": "expected error, prior"}


def cells(options: ExperimentOptions) -> list[Cell]:
    """Return a cell for each system, choice, training set, number of markers and base set."""
    counts = QUICK_MARKERS if options.quick else MARKERS
    choices = [("chosen", 0), ("all", 0)] + [(base, seed) for base in ("three", "one") for seed in options.seeds(5, 1)]
    return [
        {
            "training": training,
            "test": test,
            "markers": count,
            "system": system,
            "choice": choice,
            "seed": seed,
            "search": search_of(options),
        }
        for training in TRAININGS
        for test in motions_tested(training)
        for count in counts
        for system in METHOD
        for choice, seed in choices
    ]


def measure(*, training: str, test: str, markers: int, system: System, choice: str, seed: int, search: Search) -> Row:
    """Return mean and largest error of the vertices, mm."""
    quality = quality_of(training, markers, system)
    if choice == "chosen":
        model = best_model(training, markers, system, search, seed)
    else:
        candidates = quality.candidates
        generator = np.random.Generator(np.random.Philox(key=[seed, 0]))
        each = {"all": len(candidates), "three": 3, "one": 1}[choice]
        base = random_base(candidates, each, generator)
        chosen = wheatland_layout(candidates, base, training_postures(training), markers)
        model = candidates.layout(chosen, choice).on(candidates.hand)
    return reconstruction_error(model, quality, test, METHOD[system])._asdict()


def tabulate(rows: Sequence[Row]) -> list[Row]:
    names = ("training", "test", "markers", "system", "choice", "seed", "error_mm", "largest_mm")
    return [{name: row[name] for name in names} for row in rows]


def curve(rows: Sequence[Row], system: str, choice: str) -> dict[int, float]:
    """Return the error, mm, by number of markers; the mean over motions and base sets."""
    chosen = [row for row in rows if (row["system"], row["choice"]) == (system, choice)]
    counts = sorted({row["markers"] for row in chosen})
    return {n: float(np.mean([row["error_mm"] for row in chosen if row["markers"] == n])) for n in counts}


def compare(rows: Sequence[Row]) -> list[PaperComparison]:
    found = []
    for system, words in SYSTEMS.items():
        chosen = curve(rows, system, "chosen")
        for base, name in BASES.items():
            theirs = curve(rows, system, base)
            lower = 100 * float(np.mean([chosen[n] < theirs[n] for n in chosen]))
            found.append(PaperComparison(f"{words}: below Wheatland, {name}", "better layouts", lower, "%"))
        if 6 in chosen:
            found.append(PaperComparison(f"{words}: 6 markers", "not given", chosen[6], "mm"))
            found += [
                PaperComparison(f"{words}: Wheatland, {name}, 6", "not given", curve(rows, system, base)[6], "mm")
                for base, name in BASES.items()
            ]
    return found


def draw(axes: Axes, rows: Sequence[Row]) -> None:
    names = {"chosen": "chosen"} | {base: f"Wheatland et al., {words}" for base, words in BASES.items()}
    for (system, words), style in zip(SYSTEMS.items(), (":", "-"), strict=True):
        for k, (choice, label) in enumerate(names.items()):
            errors = curve(rows, system, choice)
            axes.plot(list(errors), list(errors.values()), style, marker="o", color=f"C{k}", label=f"{label}, {words}")
    axes.set(xlabel="markers", ylabel="error of the vertices (mm)")
    plain_log_scale(axes)
    axes.legend(fontsize=8)


EXPERIMENT = Experiment(
    name="schroeder2015-10",
    title="Our layouts, against the choice by principal components of trajectories",
    source=f"{SCHROEDER_2015}, Fig. 10",
    cells=cells,
    measure=measure,
    tabulate=tabulate,
    compare=compare,
    draw=draw,
)
