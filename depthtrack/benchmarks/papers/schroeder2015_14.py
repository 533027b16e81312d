"""Fig. 14 of Schroeder et al. 2015: time to solve a frame against the number of markers."""

from collections.abc import Sequence
from time import process_time

import numpy as np
from matplotlib.axes import Axes

from depthtrack.benchmarks.papers.experiment import Experiment, ExperimentOptions, PaperComparison
from depthtrack.benchmarks.papers.plot import plain_log_scale
from depthtrack.benchmarks.papers.schroeder2015 import SCHROEDER_2015, motion_poses, quality_of
from depthtrack.evaluation.sweep.rows import Cell, Row
from depthtrack.markers.layout.exchange import added
from depthtrack.markers.layout.reconstruction import Method, ReconstructionOptions, reconstruct

MARKERS, QUICK_MARKERS = (4, 6, 8, 10, 13, 16, 19, 22, 26), (4, 8, 16, 26)
METHODS: tuple[Method, ...] = ("subspace", "prior", "plain")
TEST = "grasp"
PAPER_MS = 5.0
_ROUNDS = 5


def cells(options: ExperimentOptions) -> list[Cell]:
    """Return a cell for each number of markers."""
    return [{"markers": count} for count in (QUICK_MARKERS if options.quick else MARKERS)]


def measure(*, markers: int) -> Row:
    """Return the CPU time of a frame on one core, ms.

    It is the least mean over the motion of a few rounds.
    """
    quality = quality_of("grasps", 6, "paper")
    model = quality.candidates.layout(added(quality, markers), "greedy").on(quality.candidates.hand)
    truth = motion_poses(TEST)
    positions, wrist = model.positions(truth), model.kinematics.wrist(truth)
    row: Row = {}
    for method in METHODS:
        options, least = ReconstructionOptions(method=method), np.inf
        for _ in range(_ROUNDS + 1):  # the first round compiles
            begun = process_time()
            reconstruct(model, positions, quality.synergies, options, wrist)
            least = min(least, process_time() - begun)
        row[f"{method}_ms"] = 1000 * least / len(truth)
    return row


def tabulate(rows: Sequence[Row]) -> list[Row]:
    return [{name: row[name] for name in ("markers", *(f"{method}_ms" for method in METHODS))} for row in rows]


def compare(rows: Sequence[Row]) -> list[PaperComparison]:
    last = max(rows, key=lambda row: row["markers"])
    return [
        PaperComparison(f"{last['markers']} markers, {method}", f"below {PAPER_MS:g} ms", last[f"{method}_ms"], "ms")
        for method in METHODS
    ]


def draw(axes: Axes, rows: Sequence[Row]) -> None:
    for method in METHODS:
        axes.plot([row["markers"] for row in rows], [row[f"{method}_ms"] for row in rows], marker="o", label=method)
    axes.plot(26, PAPER_MS, "D", color="black", label="paper, upper bound, 8 cores")
    axes.set(xlabel="markers", ylabel="CPU time of a frame (ms)")
    plain_log_scale(axes)
    axes.legend()


EXPERIMENT = Experiment(
    name="schroeder2015-14",
    title="Time to solve a frame",
    source=f"{SCHROEDER_2015}, Fig. 14",
    cells=cells,
    measure=measure,
    tabulate=tabulate,
    compare=compare,
    draw=draw,
)
