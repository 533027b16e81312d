"""Data of the plots: curves of bounded size from any number of frames and runs."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from depthtrack.evaluation.compare.results import TrackerResult, figures_of
from depthtrack.evaluation.metrics.success import LIMIT_MM, share_within
from depthtrack.hand.pose import FINGERS
from depthtrack.selection import distinct
from depthtrack.types import Array

POINTS = 900
"""Largest number of points of a curve over time, about a page's width in pixels."""
E3D_LIMIT_MM = 15.0
"""Largest threshold of the success curve by E3D, mm."""


@dataclass(frozen=True)
class TrackerSeries:
    """A tracker's result on a recording; `number` selects the tracker's colour."""

    result: TrackerResult
    number: int

    @property
    def label(self) -> str:
        """Return the tracker's label."""
        return self.result.label


@dataclass(frozen=True)
class MetricCurve:
    """A metric over time.

    seconds (N,): time since the first frame.
    median (N,), low (N,), high (N,): median and range over the runs; NaN without a value.
    frames_per_point: number of frames of a point, which has the worst of their values.
    """

    seconds: Array
    median: Array
    low: Array
    high: Array
    frames_per_point: int


def metric_curve(result: TrackerResult, metric: str) -> MetricCurve:
    """Return a metric of the result's runs over time."""
    length = max(evaluation.frames for evaluation in result.evaluations)
    rows = np.full((len(result.evaluations), length), np.nan)
    times = np.full(length, np.nan)
    for k, evaluation in enumerate(result.evaluations):
        found = figures_of(evaluation).get(metric)
        if found is not None:
            rows[k, : evaluation.frames] = found.values
        times[: evaluation.frames] = evaluation.run.timestamps
    frames = -(-length // POINTS)
    blocks = [slice(start, start + frames) for start in range(0, length, frames)]
    worst = _lowest if metric == "silhouette_iou" else _highest
    points = np.stack([worst(rows[:, block], axis=1) for block in blocks], axis=1) if length else rows
    seconds = np.array([times[block][0] for block in blocks]) - (times[0] if length else 0.0)
    median, low, high = (_reduced(reduce, points) for reduce in (np.nanmedian, np.nanmin, np.nanmax))
    return MetricCurve(seconds, median, low, high, frames_per_point=frames)


def success_curve(result: TrackerResult) -> tuple[Array, Array] | None:
    """Return the share of frames under each threshold, over all runs; None without values.

    The value of a frame is its largest error if there is ground truth, else E3D.

    Result (K,) twice: thresholds in mm, shares 0 to 1.
    """
    curves = [evaluation.success for evaluation in result.evaluations if evaluation.success is not None]
    if curves:
        thresholds = np.linspace(0, LIMIT_MM, 201)
        errors = np.concatenate([curve.errors_mm for curve in curves])
    else:
        thresholds = np.linspace(0, E3D_LIMIT_MM, 201)
        found = [figures_of(evaluation).get("e3d_mm") for evaluation in result.evaluations]
        values = [metric.values for metric in found if metric is not None]
        if not values:
            return None
        errors = np.nan_to_num(np.concatenate(values), nan=np.inf)
    return thresholds, np.array([share_within(errors, threshold) for threshold in thresholds])


def finger_errors(result: TrackerResult) -> dict[str, tuple[float, float]]:
    """Return each finger's mean error and 95th percentile over all runs, mm.

    The result is empty without ground truth.
    """
    found = {}
    for finger in FINGERS:
        values = [e.finger_errors[finger].judged for e in result.evaluations if finger in e.finger_errors]
        judged = np.concatenate(values) if values else np.empty(0)
        if len(judged):
            found[finger] = (float(judged.mean()), float(np.percentile(judged, 95)))
    return found


def stage_medians(result: TrackerResult) -> dict[str, float]:
    """Return each stage's median time over all frames and runs, milliseconds, in running order."""
    stages: dict[str, list[Array]] = {}
    for evaluation in result.evaluations:
        for stage, metric in evaluation.stage_ms.items():
            stages.setdefault(stage, []).append(metric.judged)
    joined = {stage: np.concatenate(values) for stage, values in stages.items()}
    return {stage: float(np.median(values)) for stage, values in joined.items() if len(values)}


def worst_frames(values: Array, timestamps: Array, count: int, spacing: float = 0.5) -> list[int]:
    """Return the rows of the `count` largest values, largest first.

    values (T,): errors; NaN is never chosen.
    timestamps (T,): seconds.
    spacing: smallest time between two chosen rows, seconds.
    """
    ranked = np.argsort(-np.nan_to_num(values, nan=-np.inf), kind="stable")
    judged = ranked[np.isfinite(values[ranked])]
    return distinct(judged, lambda row, chosen: np.abs(timestamps[row] - timestamps[chosen]), spacing, count)


def axis_limit(curves: Sequence[MetricCurve]) -> tuple[float, float]:
    """Return an upper axis limit that clips only rare peaks of the curves, and their maximum."""
    values = np.concatenate([curve.high for curve in curves]) if curves else np.empty(0)
    known = values[np.isfinite(values)]
    if len(known) == 0:
        return 1.0, 0.0
    largest = float(known.max())
    return (min(1.1 * largest, 1.6 * float(np.percentile(known, 98))) or 1.0), largest


def _reduced(reduce: Callable[..., Array], points: Array) -> Array:
    """Apply `reduce` over the runs (first axis); NaN without a value."""
    out = np.full(points.shape[1], np.nan)
    known = np.isfinite(points).any(axis=0)
    if known.any():
        out[known] = reduce(points[:, known], axis=0)
    return out


def _highest(values: Array, axis: int) -> Array:
    highest = np.max(np.where(np.isfinite(values), values, -np.inf), axis=axis)
    return np.where(np.isfinite(highest), highest, np.nan)


def _lowest(values: Array, axis: int) -> Array:
    return -_highest(-values, axis)
