"""Fig. 2b of Oikonomidis et al. 2011: error against the distance from the sensor."""

from collections.abc import Sequence

from matplotlib.axes import Axes

from depthtrack.benchmarks.papers import oikonomidis
from depthtrack.benchmarks.papers.experiment import Experiment, ExperimentOptions, PaperComparison
from depthtrack.evaluation.sweep.rows import Cell, Row

DISTANCES, QUICK_DISTANCES = (0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0, 2.25, 2.5), (0.5, 1.0, 1.5, 2.0, 2.5)
PAPER = {0.5: 5.0, 2.5: 7.5}
"""Errors of the paper, mm, by distance, m, from its text: 5 mm at 0.5 m, at most 7.5 mm at 2.5 m."""


def cells(options: ExperimentOptions) -> list[Cell]:
    return oikonomidis.cells(options, ({"distance_m": d} for d in (QUICK_DISTANCES if options.quick else DISTANCES)))


def tabulate(rows: Sequence[Row]) -> list[Row]:
    return oikonomidis.tabulate(rows, ("distance_m",))


def compare(rows: Sequence[Row]) -> list[PaperComparison]:
    near, far = (oikonomidis.median_error(rows, distance_m=distance) for distance in PAPER)
    return [
        PaperComparison("error at 0.5 m", "5 mm", near, "mm"),
        PaperComparison("error at 2.5 m", "at most 7.5 mm", far, "mm"),
    ]


def draw(axes: Axes, rows: Sequence[Row]) -> None:
    table = tabulate(rows)
    distances = [line["distance_m"] for line in table]
    axes.fill_between(
        distances, [line["lowest_mm"] for line in table], [line["highest_mm"] for line in table], alpha=0.2, lw=0
    )
    axes.plot(distances, [line["error_mm"] for line in table], marker="o", label="ours (band: all repetitions)")
    axes.plot(*zip(*PAPER.items(), strict=True), "D", color="black", label="paper, from its text", zorder=3)
    axes.set(xlabel="distance from the sensor (m)", ylabel="error $M_d$ (mm)", ylim=(0, None))
    axes.legend()


EXPERIMENT = Experiment(
    name="oikonomidis-2b",
    title="Error against the distance from the sensor",
    source=f"{oikonomidis.OIKONOMIDIS_2011}, Fig. 2b",
    cells=cells,
    measure=oikonomidis.track_motion,
    tabulate=tabulate,
    compare=compare,
    draw=draw,
)
