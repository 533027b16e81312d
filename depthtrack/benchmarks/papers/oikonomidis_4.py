"""Fig. 4 of Oikonomidis et al. 2011: error of poses from single frames."""

from collections.abc import Sequence
from contextlib import closing
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes

from depthtrack.benchmarks.papers import oikonomidis
from depthtrack.benchmarks.papers.experiment import Experiment, ExperimentOptions, PaperComparison
from depthtrack.benchmarks.papers.plot import mark
from depthtrack.evaluation.metrics import endpoint_error
from depthtrack.evaluation.sweep.rows import Cell, Row
from depthtrack.geometry.rotations import rotation_matrix
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import ORIENTATION
from depthtrack.options import with_options
from depthtrack.synthesis.generate import Synthesis
from depthtrack.synthesis.observations import observed_motion
from depthtrack.tracking.registry import create_tracker
from depthtrack.types import Array

FRAMES = 45
"""Number of evenly spaced frames. The paper uses 45 of a real recording, and tracked poses as ground truth."""
SEEDS, QUICK_SEEDS = 20, 5
CLOSE_MM = 40.0
"""Largest error of a successful estimate in the paper."""
SECOND_PEAK_MM = 80.0
"""Error at the second peak of the paper's histogram."""
WITHIN = "estimates within 4 cm"
BIN_MM, LAST_BIN_MM = 2.5, 120.0


def cells(options: ExperimentOptions) -> list[Cell]:
    count = len(observed_motion(Synthesis(frames=options.frames)))
    chosen = np.linspace(0, count, min(FRAMES, count), endpoint=False)
    return [
        oikonomidis.tracker_cell(options) | {"frame": int(frame), "repetition": seed}
        for frame in chosen
        for seed in options.seeds(SEEDS, QUICK_SEEDS)
    ]


def measure(
    *,
    frame: int,
    variant: Literal["default", "paper"],
    renderer: str,
    resolution: int | None,
    repetition: int,
) -> Row:
    """Estimate the pose in one frame of `everyday` at 0.5 m, without initial guess.

    `mirrored`: the palm's normal is more than 90 degrees from the true one, as if back and inside were swapped.
    """
    motion = observed_motion(Synthesis())
    tools = {"seed": repetition, "renderer": renderer, "resolution": resolution}
    config = with_options(oikonomidis.TRACKERS[variant], tools)
    with closing(create_tracker(config, motion.hand)) as tracker:
        estimate = tracker.start(motion[frame])
    assert estimate.pose is not None
    model, true_pose = HandModel(motion.hand), motion.poses[frame]
    turned = palm_angle(estimate.pose, true_pose)
    return {
        "error_mm": float(endpoint_error(model, estimate.pose[None], model, true_pose[None]).values[0]),
        "palm_turned_deg": turned,
        "mirrored": turned > 90,
        "energy": estimate.energy,
        "status": str(estimate.status),
        "ms": sum(estimate.stage_ms.values()),
    }


def palm_angle(pose: Array, true_pose: Array) -> float:
    """Return the angle between the normals of two palms, degrees.

    pose, true_pose: (27,).
    """
    normals = [rotation_matrix(each[ORIENTATION])[:, 2] for each in (pose, true_pose)]
    return float(np.degrees(np.arccos(np.clip(normals[0] @ normals[1], -1, 1))))


def tabulate(rows: Sequence[Row]) -> list[Row]:
    """Return the histogram of the error: shares of all and of mirrored estimates, percent."""
    edges = np.arange(0, LAST_BIN_MM + BIN_MM, BIN_MM)
    number = np.minimum(np.searchsorted(edges, [row["error_mm"] for row in rows], side="right") - 1, len(edges) - 1)
    mirrored = np.array([row["mirrored"] for row in rows])
    return [
        {
            "from_mm": float(start),
            "to_mm": float(start + BIN_MM) if start < LAST_BIN_MM else None,
            "share_percent": 100 * float(np.mean(number == n)),
            "mirrored_percent": 100 * float(np.mean((number == n) & mirrored)),
        }
        for n, start in enumerate(edges)
    ]


def compare(rows: Sequence[Row]) -> list[PaperComparison]:
    error, mirrored = (np.array([row[name] for row in rows]) for name in ("error_mm", "mirrored"))
    return [
        PaperComparison(WITHIN, "74 %", 100 * float(np.mean(error <= CLOSE_MM)), "%"),
        PaperComparison("mirrored poses", "the peak at about 8 cm", 100 * float(mirrored.mean()), "%"),
        PaperComparison("median error", "not given", float(np.median(error)), "mm"),
        PaperComparison(
            "median time of a start", "not given", float(np.median([row["ms"] for row in rows])) / 1000, "s"
        ),
    ]


def draw(axes: Axes, rows: Sequence[Row]) -> None:
    table = tabulate(rows)
    left = [line["from_mm"] / 10 for line in table]
    mirrored = np.array([line["mirrored_percent"] for line in table])
    upright = np.array([line["share_percent"] for line in table]) - mirrored
    bars: dict[str, Any] = {"width": BIN_MM / 10, "align": "edge", "edgecolor": "white", "lw": 0.5}
    axes.bar(left, upright, label="ours, not mirrored", **bars)
    axes.bar(left, mirrored, bottom=upright, label="ours, mirrored", **bars)
    close = next(item for item in compare(rows) if item.what == WITHIN)
    mark(axes, CLOSE_MM / 10, f"within 4 cm:\nours {close.ours_text}\npaper {close.paper}")
    mark(axes, SECOND_PEAK_MM / 10, "second peak of the paper:\nmirrored poses")
    axes.set(
        xlabel="error (cm)", ylabel="share of estimates (%)", xlim=(0, None), ylim=(0, 1.2 * max(mirrored + upright))
    )
    axes.legend(loc="center right")


EXPERIMENT = Experiment(
    name="oikonomidis-4",
    title="Error of poses found in a single frame",
    source=f"{oikonomidis.OIKONOMIDIS_2011}, Fig. 4",
    cells=cells,
    measure=measure,
    tabulate=tabulate,
    compare=compare,
    draw=draw,
)
