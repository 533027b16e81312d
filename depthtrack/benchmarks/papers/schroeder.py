"""Track a motion by fitting the surface: the measurement of Schroeder et al. 2014, Sec. VI."""

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
"""Values that an experiment does not vary: five ICP iterations on a third of the points, all degrees of freedom."""

TRACKERS = {"default": "ik", "paper": "schroeder2014"}
"""Tracker of each variant."""


def cells(options: ExperimentOptions, conditions: Iterable[Cell]) -> list[Cell]:
    """Return the cells of the conditions; the tracker is deterministic, so each occurs once.

    conditions: values that differ from DEFAULTS.
    """
    return [DEFAULTS | condition | {"variant": options.variant, "frames": options.frames} for condition in conditions]


def track_motion(
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
    """Track the motion from the true first pose by the surface fit alone.

    synergies: name for `synergy_sources.load_source`, to solve for its first `components`; None solves for all angles.
    soft: solve for all angles with the synergies as a prior.

    The hand is rendered from the skin, as in the paper, by a perfect sensor at 0.5 m. `error_deg` is the posture error
    of the paper, the mean difference of the joint angles, and `error_mm` the endpoint error; both over all frames.
    `frame_errors_deg` is the posture error of each frame. `ms_per_frame` is the CPU time of the median frame, point
    cloud included, which does not depend on other processes.
    """
    observed = observed_motion(Synthesis(motion=motion, model="skin", frames=frames))
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
    with closing(create_tracker(config, observed.hand, synergies=known)) as tracker:
        for index in range(len(observed)):
            observation, begun = observed.uncached(index), process_time()
            if index == 0:
                estimates.append(tracker.start(observation, observed.poses[0]))
            else:
                estimates.append(tracker.track(observation))
            seconds.append(process_time() - begun)
            points.append(observation.reading_count)
    hand, poses = HandModel(observed.hand), np.array([estimate.pose for estimate in estimates])
    angles = angle_error(poses, observed.poses)
    degrees, endpoints = angles.statistics(), endpoint_error(hand, poses, hand, observed.poses).statistics()
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
"""Measured values in the table."""


def tabulate(rows: Sequence[Row], by: Sequence[str]) -> list[Row]:
    """Return one line per row, with the values in `by` and the measured ones."""
    return [{name: row[name] for name in (*by, *MEASURED)} for row in rows]


def value(rows: Sequence[Row], name: str, **values: Any) -> float | None:
    """Return the measured value `name` in the row with these values; None without one."""
    found = [row[name] for row in rows if all(row[key] == wanted for key, wanted in values.items())]
    return float(found[0]) if found and found[0] is not None else None


def ratio(a: float | None, b: float | None) -> float | None:
    """Return a / b; None if one is unknown or b is 0."""
    return a / b if a is not None and b else None
