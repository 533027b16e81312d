"""Fig. 2c of Oikonomidis et al. 2011: error against noise in depth and skin labels."""

from collections.abc import Sequence

from matplotlib.axes import Axes

from depthtrack.benchmarks.papers import oikonomidis
from depthtrack.benchmarks.papers.experiment import Experiment, ExperimentOptions, PaperComparison
from depthtrack.evaluation.sweep.rows import Cell, Row

NOISE_MM, QUICK_NOISE_MM = (0.0, 10.0, 20.0, 40.0, 80.0), (0.0, 20.0, 80.0)
"""Standard deviations of the depth; the text of the paper calls its noise very heavy, without a number."""
FLIPS_PERCENT, QUICK_FLIPS_PERCENT = (0.0, 10.0, 20.0, 30.0, 40.0), (0.0, 40.0)
"""Shares of the pixels with an inverted skin label."""
PAPER_MM = (5.0, 25.0)
"""Range of the error in the text of the paper."""


def cells(options: ExperimentOptions) -> list[Cell]:
    noise = QUICK_NOISE_MM if options.quick else NOISE_MM
    flips = QUICK_FLIPS_PERCENT if options.quick else FLIPS_PERCENT
    return oikonomidis.cells(options, ({"depth_noise_mm": n, "skin_flips_percent": f} for f in flips for n in noise))


def tabulate(rows: Sequence[Row]) -> list[Row]:
    return oikonomidis.tabulate(rows, ("skin_flips_percent", "depth_noise_mm"))


def compare(rows: Sequence[Row]) -> list[PaperComparison]:
    errors = [line["error_mm"] for line in tabulate(rows)]
    return [
        PaperComparison(
            "error without noise", "5 mm", oikonomidis.median_error(rows, depth_noise_mm=0, skin_flips_percent=0), "mm"
        ),
        PaperComparison("largest error over all noise levels", "25 mm", max(errors), "mm"),
    ]


def draw(axes: Axes, rows: Sequence[Row]) -> None:
    table = tabulate(rows)
    axes.axhspan(*PAPER_MM, color="0.92", zorder=0, label="range of the paper, from its text")
    for flips in sorted({line["skin_flips_percent"] for line in table}):
        lines = [line for line in table if line["skin_flips_percent"] == flips]
        noise = [line["depth_noise_mm"] for line in lines]
        axes.plot(
            noise, [line["error_mm"] for line in lines], marker="o", label=f"ours, {flips:g} % of labels inverted"
        )
    axes.set(xlabel="depth noise, standard deviation (mm)", ylabel="error $M_d$ (mm)", ylim=(0, None))
    axes.legend()


EXPERIMENT = Experiment(
    name="oikonomidis-2c",
    title="Error against noise in depth and skin labels",
    source=f"{oikonomidis.OIKONOMIDIS_2011}, Fig. 2c",
    cells=cells,
    measure=oikonomidis.track_motion,
    tabulate=tabulate,
    compare=compare,
    draw=draw,
)
