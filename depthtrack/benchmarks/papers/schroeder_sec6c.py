"""Sec. VI-C of Schroeder et al. 2014: cylinders in place of the mesh."""

from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes

from depthtrack.benchmarks.papers import schroeder
from depthtrack.benchmarks.papers.experiment import Experiment, ExperimentOptions, PaperComparison
from depthtrack.benchmarks.papers.synergy_sources import load_source, resolve_name, short_label
from depthtrack.evaluation.sweep.rows import Cell, Row

MODELS = ("skin", "cylinders")
WORDS = {"skin": "mesh", "cylinders": "cylinders"}
COMPONENTS, QUICK_COMPONENTS = (3, 6, 9, 12, 15, 18), (6, 12)
REDUCED = 6
"""Number of synergies in the (6 + 6) degrees of freedom of the paper."""
PAPER_DEG = {"skin": 2.0, "cylinders": 4.0}
"""Errors with all degrees of freedom in the text of the paper."""
SOURCES = (schroeder.DEFAULTS["motion"], "leap")
"""Synergies of the motion, as in the paper, and of other hands."""
ALL_ANGLES = 21
"""Position of all angles on the axis of synergies."""


def cells(options: ExperimentOptions) -> list[Cell]:
    names = [resolve_name(options.synergies, name) for name in SOURCES]
    subspaces: list[Cell] = [{}]
    for name in dict.fromkeys(names):
        known = len(load_source(name).synergies)
        counts = QUICK_COMPONENTS if options.quick else COMPONENTS
        subspaces += [{"synergies": name, "components": n} for n in counts if n <= known]
    return schroeder.cells(options, ({"model": model} | subspace for subspace in subspaces for model in MODELS))


def tabulate(rows: Sequence[Row]) -> list[Row]:
    return schroeder.tabulate(rows, ("model", "synergies", "components"))


def compare(rows: Sequence[Row]) -> list[PaperComparison]:
    skin, cylinders = (schroeder.value(rows, "error_deg", model=model, components=None) for model in MODELS)
    skin_mm, cylinders_mm = (schroeder.value(rows, "error_mm", model=model, components=None) for model in MODELS)
    lines = [
        PaperComparison("joint angle error, all angles, mesh", "about 2 deg", skin, "deg"),
        PaperComparison("joint angle error, all angles, cylinders", "about 4 deg", cylinders, "deg"),
        PaperComparison("endpoint error, all angles, mesh", "not given", skin_mm, "mm"),
        PaperComparison("endpoint error, all angles, cylinders", "not given", cylinders_mm, "mm"),
    ]
    for name in _names(rows):
        skin, cylinders = (
            schroeder.value(rows, "error_deg", model=model, synergies=name, components=REDUCED) for model in MODELS
        )
        lines += [
            PaperComparison(f"6 + 6, synergies {_label(name)}, mesh", "not given", skin, "deg"),
            PaperComparison(f"6 + 6, synergies {_label(name)}, cylinders", "virtually as mesh", cylinders, "deg"),
        ]
    full, few = (_hertz(rows, n) for n in (None, REDUCED))
    return [
        *lines,
        PaperComparison("frames per second, all angles (ours: mesh, one core)", "25 (8 threads)", full, "Hz"),
        PaperComparison("frames per second, 6 + 6", "30 (8 threads)", few, "Hz"),
    ]


def draw(axes: Axes, rows: Sequence[Row]) -> None:
    for model, colour in zip(MODELS, ("C0", "C1"), strict=True):
        for name, line in zip(_names(rows), ("-", ":"), strict=False):
            reduced = [row for row in rows if row["model"] == model and row["synergies"] == name]
            axes.plot(
                [row["components"] for row in reduced],
                [row["error_deg"] for row in reduced],
                line,
                marker="o",
                color=colour,
                label=f"ours, {WORDS[model]}, synergies {_label(name)}",
            )
        full = schroeder.value(rows, "error_deg", model=model, components=None)
        if full is not None:
            axes.plot(ALL_ANGLES - 0.3, full, "s", color=colour, label=f"ours, {WORDS[model]}, all angles")
        paper: dict[str, Any] = {
            "mec": colour,
            "mfc": "black",
            "mew": 1.5,
            "label": f"paper, {WORDS[model]}, all angles",
        }
        axes.plot(ALL_ANGLES + 0.3, PAPER_DEG[model], "D", **paper)
    axes.set(xlabel="synergies besides the 6 degrees of freedom of the global pose", ylabel="joint angle error (deg)")
    axes.set(ylim=(0, 1.5 * axes.get_ylim()[1]), xlim=(0, ALL_ANGLES + 1))
    axes.set_xticks([*COMPONENTS, ALL_ANGLES], [*map(str, COMPONENTS), "all angles"])
    axes.legend(ncols=2, loc="upper right")


def _names(rows: Sequence[Row]) -> list[str]:
    return list(dict.fromkeys(row["synergies"] for row in rows if row["synergies"] is not None))


def _label(name: str) -> str:
    return "of this motion" if name == schroeder.DEFAULTS["motion"] else f"'{short_label(name)}'"


def _hertz(rows: Sequence[Row], components: int | None) -> float | None:
    return schroeder.ratio(1000, schroeder.value(rows, "ms_per_frame", model="skin", components=components))


EXPERIMENT = Experiment(
    name="schroeder-sec6c",
    title="Cylinders in place of the mesh",
    source=f"{schroeder.SCHROEDER_2014}, Sec. VI-C",
    cells=cells,
    measure=schroeder.track_motion,
    tabulate=tabulate,
    compare=compare,
    draw=draw,
)
