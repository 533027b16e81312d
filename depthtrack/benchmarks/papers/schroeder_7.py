"""Fig. 7 and Sec. VI-A of Schroeder et al. 2014: postures in few principal components."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from depthtrack.benchmarks.papers.experiment import Experiment, ExperimentOptions, PaperComparison
from depthtrack.benchmarks.papers.schroeder import SCHROEDER_2014, value
from depthtrack.benchmarks.papers.synergy_sources import load_source, motion_postures, resolve_name, short_label
from depthtrack.evaluation.metrics import angle_error, endpoint_error
from depthtrack.evaluation.sweep.rows import Cell, Row
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import make_pose
from depthtrack.hand.shape import HandShape
from depthtrack.types import Array

COUNTS, QUICK_COUNTS = tuple(range(1, 21)), (1, 2, 3, 4, 6, 8, 10, 12, 16, 20)
SETS = (("signs", "signs"), ("leap", "signs"), ("leap-grasps", "grasp"))
"""Synergies and the motion to approximate: synergies of the motion, as in the paper, and of other hands."""
PAPER_SHARES: dict[str, dict[int, str]] = {
    "signs": {},
    "leap": {3: "about 80 %", 6: "about 90 %"},
    "leap-grasps": {2: "about 83 %", 3: "90 %"},
}
"""Share of the variance by number of components in the text of Sec. VI-A: of all motions, and of grasps."""
EITHER = {2: "about 83 % of grasps", 3: "about 80 %, 90 % of grasps", 6: "about 90 %"}
"""The same for other synergies."""


def cells(options: ExperimentOptions) -> list[Cell]:
    sets: list[tuple[str, str | None]] = [*SETS]
    if options.synergies is not None:
        name = resolve_name(options.synergies, "")
        sets = [(name, "signs" if load_source(name).postures is None else None)]
    return [
        {"synergies": name, "postures": motion, "components": n}
        for name, motion in sets
        for n in (QUICK_COUNTS if options.quick else COUNTS)
        if n <= len(load_source(name).synergies)
    ]


def measure(*, synergies: str, postures: str | None, components: int) -> Row:
    """Approximate postures by the first components of synergies.

    postures: motion with the postures; None for those of the synergies' fit.

    The posture with the largest distance from the mean stands for the particular one of the paper. The errors are those
    of `schroeder.track_motion` with the true global pose.
    """
    found = load_source(synergies)
    true = found.postures if postures is None else motion_postures(postures)
    assert true is not None
    reduced = found.synergies.truncated(components)
    hand = HandModel(HandShape())
    poses, true_poses = (_still(angles) for angles in (reduced.angles(reduced.project(true)), true))
    degrees = angle_error(poses, true_poses).values
    particular = int(np.argmax(np.abs(true - true.mean(axis=0)).sum(axis=1)))
    return {
        "particular_deg": float(degrees[particular]),
        "error_deg": float(degrees.mean()),
        "p95_deg": float(np.percentile(degrees, 95)),
        "error_mm": float(endpoint_error(hand, poses, hand, true_poses).values.mean()),
        "variance_percent": 100 * found.synergies.variance_share(components),
    }


def _still(angles: Array) -> Array:
    """Return poses (N, 27) with finger angles (N, 20) and a constant global pose."""
    return make_pose(np.zeros((len(angles), 3)), np.tile([1.0, 0, 0, 0], (len(angles), 1)), angles)


def tabulate(rows: Sequence[Row]) -> list[Row]:
    names = ("synergies", "postures", "components", "variance_percent", "particular_deg", "error_deg", "p95_deg")
    return [{name: row[name] for name in (*names, "error_mm")} for row in rows]


def compare(rows: Sequence[Row]) -> list[PaperComparison]:
    shares = [
        PaperComparison(
            f"variance in the first {count} of {short_label(name)}",
            paper,
            value(rows, "variance_percent", synergies=name, components=count),
            "%",
        )
        for name in _names(rows)
        for count, paper in PAPER_SHARES.get(name, EITHER).items()
    ]
    errors = [
        PaperComparison(
            f"mean error of {_postures(rows, name)}, 6 of {short_label(name)}",
            "not given",
            value(rows, "error_deg", synergies=name, components=6),
            "deg",
        )
        for name in _names(rows)
    ]
    return [*shares, *errors]


def draw(axes: Axes, rows: Sequence[Row]) -> None:
    for number, name in enumerate(_names(rows)):
        mine = [row for row in rows if row["synergies"] == name]
        counts, colour = [row["components"] for row in mine], f"C{number}"
        label = f"{_postures(rows, name)}, by components of {short_label(name)}"
        axes.plot(counts, [row["particular_deg"] for row in mine], marker="o", color=colour, label=label)
        axes.plot(counts, [row["error_deg"] for row in mine], linestyle="--", color=colour)
    axes.plot([], [], linestyle="--", color="0.3", label="mean of all postures")
    axes.set(xlabel="principal components", ylabel="joint angle error (deg)", ylim=(0, None), xlim=(0.5, 20.5))
    axes.set_xticks(COUNTS)
    axes.legend(title="posture with the largest distance from the mean", alignment="left")


def _names(rows: Sequence[Row]) -> list[str]:
    return list(dict.fromkeys(row["synergies"] for row in rows))


def _postures(rows: Sequence[Row], name: str) -> str:
    """Return the name of the postures that the synergies of this name approximate."""
    motion = next(row["postures"] for row in rows if row["synergies"] == name)
    return "its postures" if motion is None else str(motion)


EXPERIMENT = Experiment(
    name="schroeder-7",
    title="Approximation of postures by principal components",
    source=f"{SCHROEDER_2014}, Fig. 7",
    cells=cells,
    measure=measure,
    tabulate=tabulate,
    compare=compare,
    draw=draw,
)
