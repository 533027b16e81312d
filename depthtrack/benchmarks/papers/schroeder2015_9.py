"""Fig. 9 of Schroeder et al. 2015: convergence of the swarm and the greedy choice."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields
from time import process_time

import numpy as np
from matplotlib.axes import Axes

from depthtrack.benchmarks.papers.experiment import Experiment, ExperimentOptions, PaperComparison
from depthtrack.benchmarks.papers.schroeder2015 import PAPER_SWARM, SCHROEDER_2015, layout_options, quality_of
from depthtrack.evaluation.sweep.rows import Cell, Row
from depthtrack.markers.layout.exchange import exchanged, greedy_layout, kicked
from depthtrack.markers.layout.options import LayoutOptions
from depthtrack.markers.layout.quality import LayoutQuality
from depthtrack.markers.layout.surface_swarm import swarm_layout
from depthtrack.solver.options import SwarmOptions
from depthtrack.types import Array, Index

MARKERS, QUICK_MARKERS = tuple(range(4, 13)), (4, 6, 8)
TRAININGS, QUICK_TRAININGS = ("grasps", "grasps-2", "generic"), ("grasps",)
_SHOWN = ("grasps", 8)
"""Training set and number of markers of the plot."""
_POINTS = 100
"""Points of a stored curve."""


def cells(options: ExperimentOptions) -> list[Cell]:
    """Return a cell for each training set and number of markers."""
    trainings = QUICK_TRAININGS if options.quick else TRAININGS
    if options.synergies is not None:
        trainings = (options.synergies,)
    counts = QUICK_MARKERS if options.quick else MARKERS
    return [{"training": training, "markers": count} for training in trainings for count in counts]


def measure(*, training: str, markers: int) -> Row:
    """Return energies and CPU times on one core of swarm and greedy choice.

    `exchanged` is the swarm's layout after exchanges and random changes. `small` is the layout of the default swarm
    after exchanges. `whole_s` is the time of the greedy choice if it evaluates whole layouts. `overtakes_s` is the time
    after which the swarm's energy is at most the final one of the greedy choice. Curves are (s, energy).
    """
    quality = quality_of(training, markers, "paper")
    for options in (SwarmOptions(particles=8, generations=4), PAPER_SWARM):  # the first round compiles
        greedy_curve = _Curve()
        greedy = greedy_layout(quality, markers, None, greedy_curve.add)
        greedy_s = greedy_curve.seconds()
        curve = _Curve()
        generator = np.random.Generator(np.random.Philox(key=[0, markers]))
        swarm = swarm_layout(
            quality,
            markers,
            generator,
            options,
            None,
            curve.add,
        )
        swarm_s = curve.seconds()
        begun = process_time()
        refined = kicked(quality, swarm.rows, layout_options("full").kicks if options.particles > 8 else 0, generator)
        exchange_s = process_time() - begun
        begun = process_time()
        few = options if options.particles == 8 else LayoutOptions().swarm
        generator = np.random.Generator(np.random.Philox(key=[0, markers]))
        small = exchanged(quality, swarm_layout(quality, markers, generator, few).rows)
        small_s = process_time() - begun
    begun = process_time()
    greedy_layout(WholeEvaluation(**{each.name: getattr(quality, each.name) for each in fields(quality)}), markers)
    whole_s = process_time() - begun
    overtakes = next((seconds for seconds, energy in curve.points if energy <= greedy.energy), None)
    return {
        "swarm": swarm.energy,
        "exchanged": refined.energy,
        "greedy": greedy.energy,
        "small": small.energy,
        "small_s": small_s,
        "whole_s": whole_s,
        "swarm_s": swarm_s,
        "exchange_s": exchange_s,
        "greedy_s": greedy_s,
        "overtakes_s": overtakes,
        "swarm_curve": curve.thinned(),
        "greedy_curve": greedy_curve.thinned(),
    }


class WholeEvaluation(LayoutQuality):
    """The objective, evaluated as the paper describes it: layout by layout, each to the end."""

    def grown(self, base: Index, bound: float = np.inf, pool: ThreadPoolExecutor | None = None) -> Array:
        count = len(self.candidates)
        return self.energies(np.column_stack([np.tile(base, (count, 1)), np.arange(count)]), None, pool)


class _Curve:
    """Energies over the CPU time since the start."""

    def __init__(self) -> None:
        self.points: list[tuple[float, float]] = []
        self._begun = process_time()

    def seconds(self) -> float:
        return process_time() - self._begun

    def add(self, energy: float) -> None:
        self.points.append((self.seconds(), energy))

    def thinned(self) -> list[list[float]]:
        step = max(1, len(self.points) // _POINTS)
        return [[round(seconds, 5), energy] for seconds, energy in [*self.points[::step], self.points[-1]]]


def tabulate(rows: Sequence[Row]) -> list[Row]:
    return [{name: value for name, value in row.items() if not name.endswith("curve")} for row in rows]


def compare(rows: Sequence[Row]) -> list[PaperComparison]:
    def below(name: str) -> list[bool]:
        return [row[name] < row["greedy"] - 1e-9 * abs(row["greedy"]) for row in rows]

    def above(name: str) -> list[bool]:
        return [row[name] > row["greedy"] + 1e-9 * abs(row["greedy"]) for row in rows]

    sooner = [row["overtakes_s"] is not None and row["overtakes_s"] < row["greedy_s"] for row in rows]

    def percent(flags: Sequence[bool]) -> float:
        return 100 * float(np.mean(flags))

    def median(name: str) -> float:
        return float(np.median([row[name] for row in rows]))

    return [
        PaperComparison("swarm and exchange below greedy", "always", percent(below("exchanged")), "% of layouts"),
        PaperComparison("the same above greedy", "never", percent(above("exchanged")), "% of layouts"),
        PaperComparison("swarm alone above greedy", "never", percent(above("swarm")), "% of layouts"),
        PaperComparison("100 x 40 and exchange below greedy", "not in it", percent(below("small")), "% of layouts"),
        PaperComparison("the same above greedy, 100 x 40", "not in it", percent(above("small")), "% of layouts"),
        PaperComparison("100 x 40 and exchange, one core", "not in it", median("small_s"), "s"),
        PaperComparison("swarm reaches greedy's energy before it", "always", percent(sooner), "% of layouts"),
        PaperComparison("swarm, 1000 x 100, one core", "5 to 10 s", median("swarm_s"), "s"),
        PaperComparison("longest", "10 s", max(row["swarm_s"] for row in rows), "s"),
        PaperComparison("exchange, one core", "not in it", median("exchange_s"), "s"),
        PaperComparison("greedy, one core", "45 to 180 s", median("whole_s"), "s"),
        PaperComparison("greedy with sums and bounds, one core", "not in it", median("greedy_s"), "s"),
    ]


def draw(axes: Axes, rows: Sequence[Row]) -> None:
    row = next((r for r in rows if (r["training"], r["markers"]) == _SHOWN), rows[-1])
    for name, curve in (("swarm", row["swarm_curve"]), ("greedy", row["greedy_curve"])):
        seconds, energies = np.array(curve).T
        axes.plot(np.maximum(seconds, 1e-3), energies, label=f"{name}, {row['markers']} markers")
    axes.axhline(row["exchanged"], color="C2", linestyle="--", label="swarm, then exchange")
    low = min(row["exchanged"], row["greedy"])
    axes.set(xscale="log", xlabel="CPU time (s)", ylabel="objective E", ylim=(low - 2, low + 60))
    axes.legend(loc="upper right", title=f"training: {row['training']}", alignment="left")


EXPERIMENT = Experiment(
    name="schroeder2015-9",
    title="Swarm on the skin, against greedy choice",
    source=f"{SCHROEDER_2015}, Fig. 9",
    cells=cells,
    measure=measure,
    tabulate=tabulate,
    compare=compare,
    draw=draw,
)
