"""Fig. 9 of Schroeder et al. 2014: error and time against subsampling of the points."""

from collections.abc import Sequence

from matplotlib.axes import Axes

from depthtrack.benchmarks.papers import schroeder
from depthtrack.benchmarks.papers.experiment import Experiment, ExperimentOptions, PaperComparison
from depthtrack.benchmarks.papers.plot import error_and_time
from depthtrack.evaluation.sweep.rows import Cell, Row

SUBSAMPLINGS, QUICK_SUBSAMPLINGS = tuple(range(1, 11)), (1, 3, 5, 7, 10)
"""Values of n; every n-th point is used."""
RETAINED = 3
"""Value in the further experiments of the paper."""
PAPER_DEG, PAPER_MS = 2.0, 40.0
"""From the text: less than 2 degrees (Fig. 8, same setting); about 40 ms on all cores of an eight-core Xeon."""


def cells(options: ExperimentOptions) -> list[Cell]:
    subsamplings = QUICK_SUBSAMPLINGS if options.quick else SUBSAMPLINGS
    return schroeder.cells(options, ({"subsampling": n} for n in subsamplings))


def tabulate(rows: Sequence[Row]) -> list[Row]:
    return schroeder.tabulate(rows, ("subsampling",))


def compare(rows: Sequence[Row]) -> list[PaperComparison]:
    time = schroeder.value(rows, "ms_per_frame", subsampling=RETAINED)
    return [
        PaperComparison(
            "joint angle error with a third of the points",
            "under 2 deg (its Fig. 8)",
            schroeder.value(rows, "error_deg", subsampling=RETAINED),
            "deg",
        ),
        PaperComparison(
            "joint angle error with a tenth of the points",
            "not given",
            schroeder.value(rows, "error_deg", subsampling=SUBSAMPLINGS[-1]),
            "deg",
        ),
        PaperComparison(
            "endpoint error with a third of the points",
            "not given",
            schroeder.value(rows, "error_mm", subsampling=RETAINED),
            "mm",
        ),
        PaperComparison(
            "time of a frame with a third of the points (ours: one core)", "about 40 ms (8 threads)", time, "ms"
        ),
        PaperComparison("frames per second with a third of the points", "about 25", schroeder.ratio(1000, time), "Hz"),
    ]


def draw(axes: Axes, rows: Sequence[Row]) -> None:
    error_and_time(axes, [row["subsampling"] for row in rows], rows, RETAINED, PAPER_DEG, PAPER_MS)
    axes.set(xlabel="share of the points")
    axes.set_xticks(SUBSAMPLINGS, [f"1/{n}" for n in SUBSAMPLINGS])


EXPERIMENT = Experiment(
    name="schroeder-9",
    title="Error and time against subsampling",
    source=f"{schroeder.SCHROEDER_2014}, Fig. 9",
    cells=cells,
    measure=schroeder.track_motion,
    tabulate=tabulate,
    compare=compare,
    draw=draw,
)
