"""Fig. 2a of Oikonomidis et al. 2011: error against particles and generations."""

from collections.abc import Sequence

from matplotlib.axes import Axes

from depthtrack.benchmarks.papers import oikonomidis
from depthtrack.benchmarks.papers.experiment import Experiment, ExperimentOptions, PaperComparison
from depthtrack.benchmarks.papers.plot import mark
from depthtrack.evaluation.sweep.rows import Cell, Row

PARTICLES, QUICK_PARTICLES = (16, 32, 64, 128, 256), (16, 64, 128)
GENERATIONS, QUICK_GENERATIONS = (5, 10, 15, 20, 25, 30, 40, 50), (10, 25, 40)

RETAINED = {"particles": 64, "generations": 25}
"""Budget of the further experiments of the paper; a larger one reduced the error by at most 0.5 mm."""

PAPER_MM = 5.0
"""Error of the paper at 0.5 m with that budget, from its text on Fig. 2b."""


def cells(options: ExperimentOptions) -> list[Cell]:
    particles = QUICK_PARTICLES if options.quick else PARTICLES
    generations = QUICK_GENERATIONS if options.quick else GENERATIONS
    return oikonomidis.cells(options, ({"particles": p, "generations": g} for p in particles for g in generations))


def tabulate(rows: Sequence[Row]) -> list[Row]:
    return oikonomidis.tabulate(rows, ("particles", "generations"))


def compare(rows: Sequence[Row]) -> list[PaperComparison]:
    table = tabulate(rows)
    larger = [line["error_mm"] for line in table if all(line[name] >= least for name, least in RETAINED.items())]
    speeds = [1000 / line["ms_per_frame"] for line in table if RETAINED.items() <= line.items()]
    ours = oikonomidis.median_error(rows, **RETAINED)
    return [
        PaperComparison("error at 64 particles x 25 generations", "5 mm (its Fig. 2b, 0.5 m)", ours, "mm"),
        PaperComparison(
            "largest gain of a larger budget", "0.5 mm", None if ours is None else ours - min(larger), "mm"
        ),
        PaperComparison(
            "frames per second at 64 x 25 (ours: one core)",
            "15 (GTX 580)",
            speeds[0] if speeds else None,
            "Hz",
        ),
    ]


def draw(axes: Axes, rows: Sequence[Row]) -> None:
    table = tabulate(rows)
    for particles in sorted({line["particles"] for line in table}):
        lines = sorted((line for line in table if line["particles"] == particles), key=lambda line: line["generations"])
        generations = [line["generations"] for line in lines]
        axes.plot(generations, [line["error_mm"] for line in lines], marker="o", label=f"ours, {particles} particles")
    axes.plot(RETAINED["generations"], PAPER_MM, "D", color="black", label="paper, 64 particles", zorder=3)
    mark(axes, RETAINED["generations"], "retained in the paper:\n64 particles, 25 generations")
    axes.set(xlabel="generations", ylabel="error $M_d$ (mm)", ylim=(0, None))
    axes.legend()


EXPERIMENT = Experiment(
    name="oikonomidis-2a",
    title="Error against particles and generations",
    source=f"{oikonomidis.OIKONOMIDIS_2011}, Fig. 2a",
    cells=cells,
    measure=oikonomidis.track_motion,
    tabulate=tabulate,
    compare=compare,
    draw=draw,
)
