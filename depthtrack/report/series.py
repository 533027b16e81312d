"""What the plots show of each tracker: many frames or runs, brought down to curves of bounded size."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from depthtrack.evaluation.compare.results import TrackerResult, figures_of
from depthtrack.evaluation.metrics.success import LIMIT_MM, share_within
from depthtrack.hand.pose import FINGERS
from depthtrack.selection import distinct
from depthtrack.types import Array

POINTS = 900
"""A curve over time has at most so many points: more than a page is wide in."""
E3D_LIMIT_MM = 15.0


@dataclass(frozen=True)
class TrackerSeries:
    """A tracker on a recording, as the page shows it: `number` chooses its colour, on all recordings the same."""

    line: TrackerResult
    number: int

    @property
    def label(self) -> str:
        return self.line.label


@dataclass(frozen=True)
class OverTime:
    """A figure over time: median, smallest and largest over the runs (N,), at `seconds` (N,) from the first frame.

    In long recordings a point stands for the `worst_of` frames around it, and shows the worst of them.
    """

    seconds: Array
    median: Array
    low: Array
    high: Array
    worst_of: int


def over_time(line: TrackerResult, metric: str) -> OverTime:
    """A metric of the line's runs over time; frames that cannot be judged are NaN."""
    length = max(evaluation.frames for evaluation in line.evaluations)
    rows = np.full((len(line.evaluations), length), np.nan)
    times = np.full(length, np.nan)
    for k, evaluation in enumerate(line.evaluations):
        found = figures_of(evaluation).get(metric)
        if found is not None:
            rows[k, : evaluation.frames] = found.values
        times[: evaluation.frames] = evaluation.run.timestamps
    each = -(-length // POINTS)
    blocks = [slice(start, start + each) for start in range(0, length, each)]
    worst = _lowest if metric == "silhouette_iou" else _highest
    points = np.stack([worst(rows[:, block], axis=1) for block in blocks], axis=1) if length else rows
    seconds = np.array([times[block][0] for block in blocks]) - (times[0] if length else 0.0)
    median, low, high = (_reduced(reduce, points) for reduce in (np.nanmedian, np.nanmin, np.nanmax))
    return OverTime(seconds, median, low, high, worst_of=each)


def shares(line: TrackerResult) -> tuple[Array, Array] | None:
    """Thresholds (K,) in mm and the share of frames under each, over all runs; of the largest error of a frame where
    there is a truth, else of E3D. None where neither is known."""
    curves = [evaluation.success for evaluation in line.evaluations if evaluation.success is not None]
    if curves:
        thresholds = np.linspace(0, LIMIT_MM, 201)
        errors = np.concatenate([curve.errors_mm for curve in curves])
    else:
        thresholds = np.linspace(0, E3D_LIMIT_MM, 201)
        found = [figures_of(evaluation).get("e3d_mm") for evaluation in line.evaluations]
        values = [metric.values for metric in found if metric is not None]
        if not values:
            return None
        errors = np.nan_to_num(np.concatenate(values), nan=np.inf)
    return thresholds, np.array([share_within(errors, threshold) for threshold in thresholds])


def finger_errors(line: TrackerResult) -> dict[str, tuple[float, float]]:
    """Mean and 95th percentile of each finger's error over all runs, mm; empty without a truth."""
    found = {}
    for finger in FINGERS:
        values = [e.finger_errors[finger].judged for e in line.evaluations if finger in e.finger_errors]
        judged = np.concatenate(values) if values else np.empty(0)
        if len(judged):
            found[finger] = (float(judged.mean()), float(np.percentile(judged, 95)))
    return found


def stage_medians(line: TrackerResult) -> dict[str, float]:
    """Median milliseconds of each stage over all frames of all runs, in the order in which they run."""
    stages: dict[str, list[Array]] = {}
    for evaluation in line.evaluations:
        for stage, metric in evaluation.stage_ms.items():
            stages.setdefault(stage, []).append(metric.judged)
    joined = {stage: np.concatenate(values) for stage, values in stages.items()}
    return {stage: float(np.median(values)) for stage, values in joined.items() if len(values)}


def worst_frames(values: Array, timestamps: Array, count: int, apart: float = 0.5) -> list[int]:
    """Return the rows of the `count` largest values, worst first, at least `apart` seconds from each other."""
    ranked = np.argsort(-np.nan_to_num(values, nan=-np.inf), kind="stable")
    judged = ranked[np.isfinite(values[ranked])]
    return distinct(judged, lambda row, chosen: np.abs(timestamps[row] - timestamps[chosen]), apart, count)


def top_of_scale(curves: Sequence[OverTime]) -> tuple[float, float]:
    """Upper end of an axis that shows all but the rarest peaks of the curves, and the largest value of all."""
    values = np.concatenate([curve.high for curve in curves]) if curves else np.empty(0)
    known = values[np.isfinite(values)]
    if len(known) == 0:
        return 1.0, 0.0
    largest = float(known.max())
    return (min(1.1 * largest, 1.6 * float(np.percentile(known, 98))) or 1.0), largest


def _reduced(reduce: Callable[..., Array], points: Array) -> Array:
    """`reduce` over the runs (first axis), NaN where none is known."""
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
