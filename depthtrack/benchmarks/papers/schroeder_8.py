"""Fig. 8 of Schroeder et al. 2014: error and time against ICP iterations."""

from collections.abc import Sequence

from matplotlib.axes import Axes

from depthtrack.benchmarks.papers import schroeder
from depthtrack.benchmarks.papers.experiment import Experiment, ExperimentOptions, PaperComparison
from depthtrack.benchmarks.papers.plot import error_and_time
from depthtrack.evaluation.sweep.rows import Cell, Row

ITERATIONS, QUICK_ITERATIONS = tuple(range(1, 11)), (1, 2, 3, 5, 7, 10)
RETAINED = 5
"""Iterations in the further experiments of the paper."""
PAPER_DEG, PAPER_MS = 2.0, 40.0
"""From the text: less than 2 degrees after five iterations; about 40 ms on all cores of an eight-core Xeon."""


def cells(options: ExperimentOptions) -> list[Cell]:
    iterations = QUICK_ITERATIONS if options.quick else ITERATIONS
    return schroeder.cells(options, ({"icp_iterations": n} for n in iterations))


def tabulate(rows: Sequence[Row]) -> list[Row]:
    return schroeder.tabulate(rows, ("icp_iterations",))


def compare(rows: Sequence[Row]) -> list[PaperComparison]:
    one, five = (schroeder.value(rows, "error_deg", icp_iterations=n) for n in (1, RETAINED))
    five_ms, ten_ms = (schroeder.value(rows, "ms_per_frame", icp_iterations=n) for n in (RETAINED, 2 * RETAINED))
    five_mm = schroeder.value(rows, "error_mm", icp_iterations=RETAINED)
    return [
        PaperComparison("joint angle error after 5 iterations", "under 2 deg", five, "deg"),
        PaperComparison(
            "its ratio to the error after 1 iteration", "under a third", schroeder.ratio(five, one), "of it"
        ),
        PaperComparison("endpoint error after 5 iterations", "not given", five_mm, "mm"),
        PaperComparison("time of a frame, 5 iterations (ours: one core)", "about 40 ms (8 threads)", five_ms, "ms"),
        PaperComparison(
            "ratio of the times of 10 and 5 iterations", "grows linearly", schroeder.ratio(ten_ms, five_ms), "of it"
        ),
    ]


def draw(axes: Axes, rows: Sequence[Row]) -> None:
    x = [row["icp_iterations"] for row in rows]
    error_and_time(axes, x, rows, RETAINED, PAPER_DEG, PAPER_MS)
    axes.set(xlabel="ICP iterations")
    axes.set_xticks(ITERATIONS)


EXPERIMENT = Experiment(
    name="schroeder-8",
    title="Error and time against ICP iterations",
    source=f"{schroeder.SCHROEDER_2014}, Fig. 8",
    cells=cells,
    measure=schroeder.track_motion,
    tabulate=tabulate,
    compare=compare,
    draw=draw,
)
