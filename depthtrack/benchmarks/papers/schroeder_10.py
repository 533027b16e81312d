"""Fig. 10 of Schroeder et al. 2014: grasps with fingers behind the back of the hand."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from depthtrack.benchmarks.papers import schroeder
from depthtrack.benchmarks.papers.experiment import Experiment, ExperimentOptions, PaperComparison
from depthtrack.benchmarks.papers.synergy_sources import load_source, resolve_name
from depthtrack.evaluation.sweep.rows import Cell, Row

MOTION, OTHER_GRASPS = "grasp", "other-grasps"
SHARE, LARGER_SHARE = 0.99, 0.998
"""Share of the variance that the synergies cover: that of the paper, and a larger one for synergies alone."""
FRAME_RATE = 30
PAPER_DEG = {"all angles": 12.0, "synergies alone": 4.0}
"""Errors in the text of the paper, which does not state whether its synergies are of the tracked grasps."""


def cells(options: ExperimentOptions) -> list[Cell]:
    """Return cells of all angles, and of synergies of other and these grasps.

    Synergies are used alone and, which the paper does not, as a prior.
    """
    priors = (False,) if options.variant == "paper" else (False, True)
    subspaces: list[Cell] = [{}]
    for name in dict.fromkeys([resolve_name(options.synergies, OTHER_GRASPS), MOTION]):
        synergies = load_source(name).synergies
        count, larger = synergies.components_for(SHARE), synergies.components_for(LARGER_SHARE)
        subspaces += [{"synergies": name, "components": count, "soft": soft} for soft in priors]
        if larger > count:
            subspaces.append({"synergies": name, "components": larger, "soft": False})
    return schroeder.cells(options, ({"motion": MOTION} | subspace for subspace in subspaces))


def tabulate(rows: Sequence[Row]) -> list[Row]:
    return schroeder.tabulate(rows, ("synergies", "components", "soft"))


def compare(rows: Sequence[Row]) -> list[PaperComparison]:
    other = next((row["synergies"] for row in rows if row["synergies"] not in (None, MOTION)), MOTION)
    most = max((row["components"] for row in rows if row["synergies"] == other), default=0)

    def ours(name: str, synergies: str | None = other, soft: bool = False) -> float | None:
        return schroeder.value(rows, name, synergies=synergies, soft=soft)

    hertz = [schroeder.ratio(1000, ours("ms_per_frame", synergies)) for synergies in (None, other)]
    return [
        PaperComparison("joint angle error, all angles", "about 12 deg", ours("error_deg", None), "deg"),
        PaperComparison("synergies of other grasps alone", "about 4 deg", ours("error_deg"), "deg"),
        PaperComparison(
            f"{most} synergies of other grasps alone ({100 * LARGER_SHARE:g} %)",
            "not given",
            schroeder.value(rows, "error_deg", synergies=other, soft=False, components=most),
            "deg",
        ),
        PaperComparison("synergies of these grasps alone", "about 4 deg", ours("error_deg", MOTION), "deg"),
        PaperComparison(
            "all angles, synergies of other grasps as prior", "not given", ours("error_deg", soft=True), "deg"
        ),
        PaperComparison("synergies for 99 % of other grasps' variance", "5", ours("components"), ""),
        PaperComparison("endpoint error, all angles", "not given", ours("error_mm", None), "mm"),
        PaperComparison("endpoint error, synergies of other grasps alone", "not given", ours("error_mm"), "mm"),
        PaperComparison("frames per second, all angles (ours: one core)", "25 (8 threads)", hertz[0], "Hz"),
        PaperComparison("frames per second, synergies alone", "30 (8 threads)", hertz[1], "Hz"),
    ]


def draw(axes: Axes, rows: Sequence[Row]) -> None:
    drawn = set[tuple[object, bool]]()
    for row in rows:
        # Rows with the number of synergies of the paper come first; others are left out.
        if row["synergies"] == MOTION or (row["synergies"], row["soft"]) in drawn:
            continue
        drawn.add((row["synergies"], row["soft"]))
        soft, kind = row["soft"], "all angles" if row["synergies"] is None else "synergies alone"
        colour, label = ("C2", "all angles, synergies as prior") if soft else (_COLOURS[kind], kind)
        seconds = np.arange(len(row["frame_errors_deg"])) / FRAME_RATE
        axes.plot(seconds, row["frame_errors_deg"], color=colour, label=f"ours, {label}")
        if not soft:
            axes.axhline(PAPER_DEG[kind], color=colour, linestyle="--", lw=1, label=f"paper, mean, {kind}")
    axes.set(xlabel="time into the motion (s)", ylabel="joint angle error (deg)")
    axes.set(ylim=(0, 1.25 * axes.get_ylim()[1]))
    axes.legend(ncols=2, loc="upper left")


_COLOURS = {"all angles": "C1", "synergies alone": "C0"}

EXPERIMENT = Experiment(
    name="schroeder-10",
    title="Grasps with hidden fingers: all angles, and synergies",
    source=f"{schroeder.SCHROEDER_2014}, Fig. 10",
    cells=cells,
    measure=schroeder.track_motion,
    tabulate=tabulate,
    compare=compare,
    draw=draw,
)
