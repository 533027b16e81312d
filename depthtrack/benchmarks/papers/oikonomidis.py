"""Following the hand through the `everyday` motion: the measurement that Fig. 2a to 2d of Oikonomidis 2011 repeat."""

from collections.abc import Iterable, Sequence
from contextlib import closing
from typing import Any, Literal

import numpy as np

from depthtrack.benchmarks.papers.experiment import ExperimentOptions
from depthtrack.benchmarks.papers.no_recovery import without_recovery
from depthtrack.evaluation.metrics import angle_error, endpoint_error
from depthtrack.evaluation.sweep.rows import Cell, Row
from depthtrack.hand.kinematics import HandModel
from depthtrack.synthesis.generate import Synthesis
from depthtrack.synthesis.observations import observed_motion
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
"""What an experiment leaves as it is: the budget that the paper retained, half a metre, a perfect sensor."""


TRACKERS = {"default": "pso", "paper": "oikonomidis2011"}
"""Tracker of each variant."""


def cells(options: ExperimentOptions, conditions: Iterable[Cell]) -> list[Cell]:
    """Every condition, a change from the usual one, as often as the options ask, each time with another seed."""
    return [
        DEFAULTS | condition | tracker_cell(options) | {"frames": options.frames, "repetition": seed}
        for condition in conditions
        for seed in options.seeds(REPETITIONS, QUICK_REPETITIONS)
    ]


def tracker_cell(options: ExperimentOptions) -> Cell:
    """The part of a cell that says how the tracker works."""
    return {"variant": options.variant, "renderer": options.renderer, "resolution": options.side}


def follow(
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
    """Track from the true first pose on, by the swarm alone: a frame's budget stays what the cell says.

    `error_mm` is the paper's Delta: the phalanx endpoints' distance from the truth, over all of them and all frames.
    Repetitions see the same frames and differ in the swarm's seed.
    """
    seen = observed_motion(
        Synthesis(
            distance=distance_m,
            viewpoint=viewpoint,
            depth_noise=depth_noise_mm / 1000,
            skin_flips=skin_flips_percent / 100,
            frames=frames,
        )
    )
    config = without_recovery(
        tracker_config(
            TRACKERS[variant],
            particles=particles,
            generations=generations,
            seed=repetition,
            renderer=renderer,
            resolution=resolution,
        )
    )
    with closing(create_tracker(config, seen.hand)) as tracker:
        estimates = [tracker.start(seen[0], seen.poses[0]), *(tracker.track(seen[i]) for i in range(1, len(seen)))]
    model, poses = HandModel(seen.hand), np.array([estimate.pose for estimate in estimates])
    error = endpoint_error(model, poses, model, seen.poses).statistics()
    return {
        "error_mm": error["mean"],
        "median_frame_mm": error["median"],
        "p95_frame_mm": error["p95"],
        "angle_error_deg": angle_error(poses, seen.poses).statistics()["mean"],
        "ms_per_frame": float(np.median([sum(estimate.stage_ms.values()) for estimate in estimates])),
    }


def tabulate(rows: Sequence[Row], by: Sequence[str]) -> list[Row]:
    """A line for every combination of the values of `by`: M_d, the median of Delta over the repetitions, and more."""
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
    """M_d, millimetres, of the rows that have these values; None without any."""
    errors = [row["error_mm"] for row in rows if all(row[name] == value for name, value in values.items())]
    return float(np.median(errors)) if errors else None
