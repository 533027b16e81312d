"""Following a motion by fitting the hand's surface: what Sec. VI of Schroeder et al. 2014 repeats and varies."""

from collections.abc import Iterable, Sequence
from contextlib import closing
from time import process_time
from typing import Any, Literal

import numpy as np

from depthtrack.benchmarks.papers.experiment import ExperimentOptions
from depthtrack.benchmarks.papers.no_recovery import without_recovery
from depthtrack.benchmarks.papers.synergy_sources import load_source
from depthtrack.evaluation.metrics import angle_error, endpoint_error
from depthtrack.evaluation.sweep.rows import Cell, Row
from depthtrack.hand.kinematics import HandModel
from depthtrack.synthesis.generate import Synthesis
from depthtrack.synthesis.observations import observed_motion
from depthtrack.tracking.registry import create_tracker, tracker_config
from depthtrack.tracking.tracker import Estimate

SCHROEDER_2014 = "Schroeder, Maycock, Ritter and Botsch, ICRA 2014"
DEFAULTS: Cell = {
    "motion": "everyday",
    "model": "skin",
    "icp_iterations": 5,
    "subsampling": 3,
    "synergies": None,
    "components": None,
    "soft": False,
}
"""What an experiment leaves as it is: five ICP iterations on a third of the points, all degrees of freedom."""


TRACKERS = {"default": "ik", "paper": "schroeder2014"}
"""Tracker of each variant."""


def cells(options: ExperimentOptions, conditions: Iterable[Cell]) -> list[Cell]:
    """Every condition, a change from the usual one. The tracker draws nothing at random: once is enough."""
    return [DEFAULTS | condition | {"variant": options.variant, "frames": options.frames} for condition in conditions]


def follow(
    *,
    motion: str,
    model: Literal["skin", "cylinders"],
    icp_iterations: int,
    subsampling: int,
    synergies: str | None,
    components: int | None,
    soft: bool,
    variant: Literal["default", "paper"],
    frames: int | None,
) -> Row:
    """Track from the true first pose on, by fitting alone.

    The hand is rendered from the skin, as the paper's is, by a perfect sensor half a metre away. Of `synergies`, a
    name that `load_source` knows, the first `components` are solved for; None solves for all angles, and so does
    `soft`, drawn to what those synergies hold likely.

    `error_deg` is the paper's posture error, the mean difference of the joint angles; `error_mm` the phalanx
    endpoints' distance from the truth; both over all frames, and `frame_errors_deg` of each. `ms_per_frame` is the
    processor time of the median frame, from the depth map to the pose, point cloud included: what the wall clock shows
    on an idle core, whoever else is at work.
    """
    seen = observed_motion(Synthesis(motion=motion, model="skin", frames=frames))
    config = without_recovery(
        tracker_config(
            TRACKERS[variant],
            surface=model,
            icp_iterations=icp_iterations,
            subsample=subsampling,
            **({} if synergies is None else {"synergies": synergies, "synergy_prior": soft}),
        )
    )
    known = None if synergies is None else load_source(synergies).synergies.truncated(components or 20)
    points, seconds, estimates = [], [], list[Estimate]()
    with closing(create_tracker(config, seen.hand, synergies=known)) as tracker:
        for index in range(len(seen)):
            observation, begun = seen.uncached(index), process_time()
            if index == 0:
                estimates.append(tracker.start(observation, seen.poses[0]))
            else:
                estimates.append(tracker.track(observation))
            seconds.append(process_time() - begun)
            points.append(len(observation.points))
    hand, poses = HandModel(seen.hand), np.array([estimate.pose for estimate in estimates])
    angles, endpoints = angle_error(poses, seen.poses), endpoint_error(hand, poses, hand, seen.poses).statistics()
    degrees = angles.statistics()
    return {
        "error_deg": degrees["mean"],
        "median_frame_deg": degrees["median"],
        "p95_frame_deg": degrees["p95"],
        "error_mm": endpoints["mean"],
        "median_frame_mm": endpoints["median"],
        "points": round(float(np.mean(points)) / subsampling),
        "ms_per_frame": 1000 * float(np.median(seconds)),
        "frame_errors_deg": [round(float(value), 3) for value in angles.values],
    }


MEASURED = ("error_deg", "median_frame_deg", "p95_frame_deg", "error_mm", "median_frame_mm", "points", "ms_per_frame")


def tabulate(rows: Sequence[Row], by: Sequence[str]) -> list[Row]:
    """A line a row: what was varied, and what came of it."""
    return [{name: row[name] for name in (*by, *MEASURED)} for row in rows]


def value(rows: Sequence[Row], name: str, **values: Any) -> float | None:
    """What was measured under `name` in the row that has these values; None without one."""
    found = [row[name] for row in rows if all(row[key] == wanted for key, wanted in values.items())]
    return float(found[0]) if found and found[0] is not None else None


def ratio(a: float | None, b: float | None) -> float | None:
    """a / b, where both are known."""
    return a / b if a is not None and b else None
