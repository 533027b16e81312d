"""Fig. 2d of Oikonomidis et al. 2011: error from eight viewpoints around the scene."""

from collections.abc import Sequence

from matplotlib.axes import Axes

from depthtrack.benchmarks.papers import oikonomidis
from depthtrack.benchmarks.papers.experiment import Experiment, ExperimentOptions, PaperComparison
from depthtrack.evaluation.sweep.rows import Cell, Row
from depthtrack.synthesis.viewpoint import VIEWPOINT_COUNT


def cells(options: ExperimentOptions) -> list[Cell]:
    return oikonomidis.cells(options, ({"viewpoint": viewpoint} for viewpoint in range(VIEWPOINT_COUNT)))


def tabulate(rows: Sequence[Row]) -> list[Row]:
    return oikonomidis.tabulate(rows, ("viewpoint",))


def compare(rows: Sequence[Row]) -> list[PaperComparison]:
    errors = [line["error_mm"] for line in tabulate(rows)]
    return [
        PaperComparison(
            "largest minus smallest error of the viewpoints", "not significant", max(errors) - min(errors), "mm"
        ),
        PaperComparison("largest error of the viewpoints", "not given", max(errors), "mm"),
    ]


def draw(axes: Axes, rows: Sequence[Row]) -> None:
    table = tabulate(rows)
    error = [line["error_mm"] for line in table]
    bars = [
        [line["error_mm"] - line["lowest_mm"] for line in table],
        [line["highest_mm"] - line["error_mm"] for line in table],
    ]
    axes.errorbar(
        [line["viewpoint"] for line in table],
        error,
        bars,
        fmt="o",
        capsize=4,
        label="ours (bars: all repetitions)",
    )
    axes.axhline(5, color="black", linestyle="--", lw=1, label="paper at 0.5 m (its Fig. 2b), from its text")
    axes.set(
        xlabel="viewpoint (0: frontal)",
        ylabel="error $M_d$ (mm)",
        ylim=(0, 1.1 * max(5, *error, *(line["highest_mm"] for line in table))),
    )
    axes.set_xticks(range(VIEWPOINT_COUNT))
    axes.legend()


EXPERIMENT = Experiment(
    name="oikonomidis-2d",
    title="Error from eight viewpoints",
    source=f"{oikonomidis.OIKONOMIDIS_2011}, Fig. 2d",
    cells=cells,
    measure=oikonomidis.track_motion,
    tabulate=tabulate,
    compare=compare,
    draw=draw,
)
