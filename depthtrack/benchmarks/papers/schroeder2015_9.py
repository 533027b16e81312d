"""Fig. 9 of Schroeder et al. 2015: convergence of the swarm and the greedy choice."""

from collections.abc import Sequence
from time import process_time

import numpy as np
from matplotlib.axes import Axes

from depthtrack.benchmarks.papers.experiment import Experiment, ExperimentOptions, PaperComparison
from depthtrack.benchmarks.papers.schroeder2015 import PAPER_SWARM, SCHROEDER_2015, layout_options, quality_of
from depthtrack.benchmarks.papers.schroeder2015_greedy import WholeEvaluation, next_better
from depthtrack.evaluation.sweep.rows import Cell, Row
from depthtrack.markers.layout.exchange import added, exchanged, greedy_layout
from depthtrack.markers.layout.quality import LayoutQuality
from depthtrack.markers.layout.search import find_layout_of
from depthtrack.markers.layout.surface_swarm import swarm_layout
from depthtrack.solver.options import SwarmOptions

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
    starts = 10 if options.quick else 60
    return [{"training": training, "markers": count, "starts": starts} for training in trainings for count in counts]


def measure(*, training: str, markers: int, starts: int) -> Row:
    """Return energies and CPU times on one core of swarm and greedy choice.

    `swarm` is that of the paper, `seeded` the same with one particle at the greedy choice, whose time it includes.
    `found` is the layout of `markers layout`. `whole` is the time of the greedy choice if each layout is evaluated from
    its markers, `next` its other reading: `next_better`. `overtakes_s` is the time after which the energy of the
    swarm is at most the final one of the greedy choice. `least` is the least energy of exchanges from random layouts,
    and `reached` the share of them that reach the least energy of all. Curves are (s, energy).
    """
    quality = quality_of(training, markers, "paper")
    _compile(quality, markers)
    greedy_curve, curve, seeded_curve = _Curve(), _Curve(), _Curve()
    greedy_curve.start()
    greedy = greedy_layout(quality, markers, None, greedy_curve.add)
    greedy_s = greedy_curve.seconds()
    curve.start()
    swarm = swarm_layout(quality, markers, _generator(0, markers), PAPER_SWARM, None, curve.add)
    swarm_s = curve.seconds()
    seeded_curve.start()
    seeded = swarm_layout(
        quality,
        markers,
        _generator(0, markers),
        PAPER_SWARM,
        None,
        seeded_curve.add,
        greedy_layout(quality, markers).rows,
    )
    seeded_s = seeded_curve.seconds()
    begun = process_time()
    found = find_layout_of(quality, markers, layout_options("full"), threads=1)
    found_s = process_time() - begun
    whole, begun = WholeEvaluation.like(quality), process_time()
    greedy_layout(whole, markers)
    whole_s = process_time() - begun
    following, begun = WholeEvaluation.like(quality), process_time()
    after = next_better(following, added(following, markers))
    next_s = process_time() - begun
    first = quality.candidates.random_rows((starts, markers), _generator(1, markers))
    ends = np.array([exchanged(quality, rows).energy for rows in first])
    least = min(greedy.energy, swarm.energy, seeded.energy, found.energy, ends.min())
    return {
        "greedy": greedy.energy,
        "next": after.energy,
        "swarm": swarm.energy,
        "seeded": seeded.energy,
        "found": found.energy,
        "least": float(ends.min()),
        "reached": float(np.mean(ends <= least + _same(least))),
        "greedy_s": greedy_s,
        "whole_s": whole_s,
        "whole_layouts": int(whole.evaluated[0]),
        "next_s": next_s,
        "next_layouts": int(following.evaluated[0]),
        "swarm_s": swarm_s,
        "seeded_s": seeded_s,
        "found_s": found_s,
        "overtakes_s": next((s for s, energy in curve.points if energy <= greedy.energy + _same(greedy.energy)), None),
        "swarm_curve": curve.thinned(),
        "greedy_curve": greedy_curve.thinned(),
    }


def _compile(quality: LayoutQuality, markers: int) -> None:
    """Run each kernel once, so that no time includes compilation."""
    greedy_layout(WholeEvaluation.like(quality), markers)
    greedy_layout(quality, markers)
    swarm_layout(quality, markers, _generator(0, markers), SwarmOptions(particles=8, generations=4))


def _generator(seed: int, markers: int) -> np.random.Generator:
    return np.random.Generator(np.random.Philox(key=[seed, markers]))


def _same(energy: float) -> float:
    """Return the difference up to which energies are equal but for rounding."""
    return 1e-9 * abs(energy)


class _Curve:
    """Energies over the CPU time since the start."""

    def __init__(self) -> None:
        self.points: list[tuple[float, float]] = []
        self._begun = 0.0

    def start(self) -> None:
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
    def percent(flags: Sequence[bool]) -> float:
        return 100 * float(np.mean(flags))

    def median(name: str) -> float:
        return float(np.median([row[name] for row in rows]))

    def sooner(name: str) -> float:
        return percent([row["overtakes_s"] is not None and row["overtakes_s"] < row[name] for row in rows])

    lines = []
    for name, words, paper in (
        ("swarm", "the paper's swarm", "always"),
        ("seeded", "with a particle at greedy's", "not in it"),
        ("found", "swarm, exchanges, changes", "not in it"),
    ):
        below = percent([row[name] < row["greedy"] - _same(row["greedy"]) for row in rows])
        above = percent([row[name] > row["greedy"] + _same(row["greedy"]) for row in rows])
        lines.append(PaperComparison(f"{words}: below greedy", paper, below, "%"))
        lines.append(PaperComparison(f"{words}: above greedy", "not in it", above, "%"))
    equal = [row for row in rows if abs(row["found"] - row["greedy"]) <= _same(row["greedy"])]
    beaten = [row["least"] < row["greedy"] - _same(row["greedy"]) for row in equal]
    return [
        *lines,
        PaperComparison(f"{len(equal)} equal greedy: random starts below", "not in it", float(sum(beaten)), ""),
        PaperComparison(
            "the paper's swarm: below greedy, next better",
            "always",
            percent([row["swarm"] < row["next"] - _same(row["next"]) for row in rows]),
            "%",
        ),
        PaperComparison("swarm, 1000 x 100, one core", "5 to 10 s", median("swarm_s"), "s"),
        PaperComparison("longest", "10 s", max(row["swarm_s"] for row in rows), "s"),
        PaperComparison("with a particle at greedy's", "not in it", median("seeded_s"), "s"),
        PaperComparison("100 x 40, exchanges, changes", "not in it", median("found_s"), "s"),
        PaperComparison("greedy, whole layouts", "45 to 180 s", median("whole_s"), "s"),
        PaperComparison("greedy, next better vertices", "45 to 180 s", median("next_s"), "s"),
        PaperComparison("greedy with sums and bounds", "not in it", median("greedy_s"), "s"),
        PaperComparison("layouts evaluated: swarm", "100,000", float(_evaluations()), ""),
        PaperComparison("layouts evaluated: greedy", "not given", median("whole_layouts"), ""),
        PaperComparison("layouts evaluated: greedy, next better", "not given", median("next_layouts"), ""),
        PaperComparison("swarm reaches greedy's energy sooner", "always", sooner("whole_s"), "%"),
        PaperComparison("sooner than with sums and bounds", "not in it", sooner("greedy_s"), "%"),
    ]


def _evaluations() -> int:
    return PAPER_SWARM.particles * PAPER_SWARM.generations


def draw(axes: Axes, rows: Sequence[Row]) -> None:
    row = next((r for r in rows if (r["training"], r["markers"]) == _SHOWN), rows[-1])
    for name, curve in (("swarm", row["swarm_curve"]), ("greedy", row["greedy_curve"])):
        seconds, energies = np.array(curve).T
        axes.plot(np.maximum(seconds, 1e-3), energies, label=f"{name}, {row['markers']} markers")
    axes.axhline(row["found"], color="C2", linestyle="--", label="small swarm, exchanges, changes")
    axes.axhline(row["seeded"], color="C3", linestyle=":", label="swarm with a particle at greedy's")
    low = min(row["found"], row["swarm"], row["greedy"])
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
