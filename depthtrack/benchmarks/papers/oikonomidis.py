"""Track the `everyday` motion with a swarm, as in Fig. 2a to 2d of Oikonomidis 2011."""

from collections.abc import Iterable, Sequence
from contextlib import closing
from typing import Any, Literal

import numpy as np

from depthtrack.benchmarks.papers.experiment import ExperimentOptions
from depthtrack.benchmarks.papers.no_recovery import without_recovery
from depthtrack.evaluation.metrics import angle_error, endpoint_error
from depthtrack.evaluation.sweep.rows import Cell, Row
from depthtrack.hand.kinematics import HandModel
from depthtrack.options import with_options
from depthtrack.synthesis.generate import Synthesis
from depthtrack.synthesis.observations import observed_motion
from depthtrack.tracking.configuration import PsoConfig, TrackerConfig
from depthtrack.tracking.registry import create_tracker, tracker_config

OIKONOMIDIS_2011 = "Oikonomidis, Kyriazis and Argyros, BMVC 2011"
REPETITIONS, QUICK_REPETITIONS = 20, 3
DEFAULTS: Cell = {
    "distance_m": 0.5,
    "viewpoint": 0,
    "depth_noise_mm": 0.0,
    "skin_flips_percent": 0.0,
    "particles": 64,
    "generations": 25,
}
"""Values that an experiment does not vary: the budget that the paper retained, 0.5 m, a perfect sensor."""

TRACKERS: dict[str, TrackerConfig] = {"default": PsoConfig(refine=False), "paper": tracker_config("oikonomidis2011")}
"""Tracker of each variant: the swarm alone, whose particles and generations the experiments vary."""


def cells(options: ExperimentOptions, conditions: Iterable[Cell]) -> list[Cell]:
    """Return the cells of the conditions, one per seed.

    conditions: values that differ from DEFAULTS.
    """
    return [
        DEFAULTS | condition | tracker_cell(options) | {"frames": options.frames, "repetition": seed}
        for condition in conditions
        for seed in options.seeds(REPETITIONS, QUICK_REPETITIONS)
    ]


def tracker_cell(options: ExperimentOptions) -> Cell:
    """Return the values of a cell that configure the tracker."""
    return {"variant": options.variant, "renderer": options.renderer, "resolution": options.side}


def track_motion(
    *,
    distance_m: float,
    viewpoint: int,
    depth_noise_mm: float,
    skin_flips_percent: float,
    particles: int,
    generations: int,
    variant: Literal["default", "paper"],
    renderer: str,
    resolution: int | None,
    frames: int | None,
    repetition: int,
) -> Row:
    """Track the motion from the true first pose by the swarm alone, with the budget of the cell.

    `error_mm` is Delta of the paper: the mean endpoint error over all endpoints and frames. Repetitions track the same
    frames with another seed of the swarm.
    """
    motion = observed_motion(
        Synthesis(
            distance=distance_m,
            viewpoint=viewpoint,
            depth_noise=depth_noise_mm / 1000,
            skin_flips=skin_flips_percent / 100,
            frames=frames,
        )
    )
    config = without_recovery(
        with_options(
            TRACKERS[variant],
            {
                "particles": particles,
                "generations": generations,
                "seed": repetition,
                "renderer": renderer,
                "resolution": resolution,
            },
        )
    )
    with closing(create_tracker(config, motion.hand)) as tracker:
        first = tracker.start(motion[0], motion.poses[0])
        estimates = [first, *(tracker.track(motion[i]) for i in range(1, len(motion)))]
    model, poses = HandModel(motion.hand), np.array([estimate.pose for estimate in estimates])
    error = endpoint_error(model, poses, model, motion.poses).statistics()
    return {
        "error_mm": error["mean"],
        "median_frame_mm": error["median"],
        "p95_frame_mm": error["p95"],
        "angle_error_deg": angle_error(poses, motion.poses).statistics()["mean"],
        "ms_per_frame": float(np.median([sum(estimate.stage_ms.values()) for estimate in estimates])),
    }


def tabulate(rows: Sequence[Row], by: Sequence[str]) -> list[Row]:
    """Return one line per combination of the values in `by`, with medians over the repetitions.

    `error_mm` is M_d of the paper, the median of Delta.
    """
    groups: dict[tuple[Any, ...], list[Row]] = {}
    for row in rows:
        groups.setdefault(tuple(row[name] for name in by), []).append(row)
    return [dict(zip(by, values, strict=True)) | _summary(group) for values, group in groups.items()]


def _summary(rows: Sequence[Row]) -> Row:
    errors = [row["error_mm"] for row in rows]
    return {
        "repetitions": len(rows),
        "error_mm": float(np.median(errors)),
        "lowest_mm": min(errors),
        "highest_mm": max(errors),
        **{
            name: float(np.median([row[name] for row in rows]))
            for name in ("median_frame_mm", "p95_frame_mm", "angle_error_deg", "ms_per_frame")
        },
    }


def median_error(rows: Sequence[Row], **values: Any) -> float | None:
    """Return M_d, mm, of the rows with these values; None without any."""
    errors = [row["error_mm"] for row in rows if all(row[name] == value for name, value in values.items())]
    return float(np.median(errors)) if errors else None
