"""Fig. 10 of Schroeder et al. 2014 and its text: grasps whose fingers the back of the hand hides."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from depthtrack.evaluation.experiments import bases, schroeder
from depthtrack.evaluation.experiments.experiment import Comparison, Experiment, ExperimentOptions
from depthtrack.evaluation.sweep.rows import Cell, Row

MOTION, GRASPS, SHARE = "grasp", "leap-grasps", 0.99
"""Synergies of other grasps, as many as cover this share of their variance."""
PAPER_DEG = {"all angles": 12.0, "synergies of grasps": 4.0}
"""Read from the text."""
FRAME_RATE = 30


def cells(options: ExperimentOptions) -> list[Cell]:
    name = bases.chosen(options.synergies, GRASPS)
    reduced = {"synergies": name, "components": bases.basis(name).synergies.components_for(SHARE)}
    return schroeder.cells(options, ({"motion": MOTION} | space for space in ({}, reduced)))


def tabulate(rows: Sequence[Row]) -> list[Row]:
    return schroeder.tabulate(rows, ("synergies", "components"))


def compare(rows: Sequence[Row]) -> list[Comparison]:
    def both(name: str) -> tuple[float | None, float | None]:
        reduced = {"synergies": _grasps(rows)}
        return schroeder.value(rows, name, synergies=None), schroeder.value(rows, name, **reduced)

    (full_deg, few_deg), (full_mm, few_mm), (full_ms, few_ms) = map(both, ("error_deg", "error_mm", "ms_per_frame"))
    count = both("components")[1]
    return [
        Comparison("joint angle error, all angles", "about 12 deg", full_deg, "deg"),
        Comparison("joint angle error, synergies of grasps", "about 4 deg", few_deg, "deg"),
        Comparison("synergies for 99 % of the variance of grasps", "5", count, "synergies"),
        Comparison("endpoint error, all angles", "not told", full_mm, "mm"),
        Comparison("endpoint error, synergies of grasps", "not told", few_mm, "mm"),
        Comparison(
            "frames a second, all angles (ours: one core)", "25 (8 threads)", schroeder.ratio(1000, full_ms), "Hz"
        ),
        Comparison("frames a second, synergies of grasps", "30 (8 threads)", schroeder.ratio(1000, few_ms), "Hz"),
    ]


def draw(axes: Axes, rows: Sequence[Row]) -> None:
    for row in rows:
        space, colour = ("all angles", "C1") if row["synergies"] is None else ("synergies of grasps", "C0")
        seconds = np.arange(len(row["frame_errors_deg"])) / FRAME_RATE
        axes.plot(seconds, row["frame_errors_deg"], color=colour, label=f"ours, {space}")
        axes.axhline(PAPER_DEG[space], color=colour, linestyle="--", lw=1, label=f"paper, mean, {space}")
    axes.set(xlabel="time into the motion (s)", ylabel="joint angle error (deg)", ylim=(0, None))
    axes.legend(ncols=2)


def _grasps(rows: Sequence[Row]) -> str | None:
    return next((row["synergies"] for row in rows if row["synergies"] is not None), "")


EXPERIMENT = Experiment(
    "schroeder-10",
    "Grasps with hidden fingers, all angles and synergies",
    f"{schroeder.SCHROEDER_2014}, Fig. 10",
    cells,
    schroeder.follow,
    tabulate,
    compare,
    draw,
)
