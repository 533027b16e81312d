"""A run held against its recording: what `depthtrack evaluate` reports."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from depthtrack.evaluation.metrics import (
    Losses,
    Metric,
    PointErrors,
    SuccessCurve,
    added_jitter,
    angle_error,
    endpoint_errors,
    find_losses,
    frame_time,
    jitter,
    joint_errors,
    stage_times,
)
from depthtrack.evaluation.replay import Replay, ReplayedFrame
from depthtrack.evaluation.residuals import run_residuals
from depthtrack.hand.kinematics import HandModel
from depthtrack.recording.run_folder import Run
from depthtrack.recording.sequence import GroundTruth
from depthtrack.tracking.run_configuration import RunConfiguration
from depthtrack.types import Array

FrameProgress = Callable[[Iterable[ReplayedFrame]], Iterable[ReplayedFrame]]
"""Wraps the frames as they are looked at again: a progress bar."""


@dataclass(frozen=True)
class Evaluation:
    """All figures of one run; rows are the run's frames.

    `metrics` a value a frame each, in the order to show them: errors where there is a truth (of `points`: endpoints, or
    annotated joints), then what needs none. `success` and `points` are None without a truth. `losses` as the tracker
    saw it. `ms_per_frame` and `stage_ms` time.
    """

    run: Run
    configuration: RunConfiguration
    recording: str
    metrics: tuple[Metric, ...]
    points: PointErrors | None
    success: SuccessCurve | None
    losses: Losses
    ms_per_frame: Metric
    stage_ms: dict[str, Metric]

    @property
    def frames(self) -> int:
        return len(self.run.index)

    @property
    def lost_frames(self) -> int:
        """Frames without a trusted pose: lost, or without any hand observed."""
        return int(self.losses.lost.sum() + self.losses.absent.sum())

    @property
    def finger_errors(self) -> dict[str, Metric]:
        """The error of each finger, mm, by `pose.FINGERS`; empty without a truth."""
        return {} if self.points is None else self.points.by_finger()

    def metric(self, name: str) -> Metric | None:
        """One of `metrics` by its name, or None where the recording does not allow it."""
        return next((metric for metric in self.metrics if metric.name == name), None)

    def to_json(self) -> dict[str, Any]:
        """Statistics of every metric; keys carry the unit."""
        fingers = {finger: metric.statistics() for finger, metric in self.finger_errors.items()}
        return {
            "run": str(self.run.folder),
            "recording": self.recording,
            "tracker": self.configuration.tracker.name,
            "frames": self.frames,
            **self.losses.to_json(),
            **{metric.name: metric.statistics() for metric in self.metrics},
            **({} if self.points is None else {f"finger_{self.points.metric}": fingers}),
            **({} if self.success is None else self.success.to_json()),
            "ms_per_frame": self.ms_per_frame.statistics(),
            "stage_ms": {stage: metric.statistics() for stage, metric in self.stage_ms.items()},
        }


def evaluate_run(
    folder: Path, sequence: Path | None = None, residuals: bool = True, progress: FrameProgress | None = None
) -> Evaluation:
    """Hold the run in `folder` against the recording it tracked, or against `sequence` where that has moved.

    `residuals` looks at every frame again, which takes as long as segmenting it and a little more; without them the
    label-free metrics of the silhouette and the surface are left out. Raises InputError.
    """
    return evaluate(Replay.open(Run.load(folder), sequence), residuals, progress)


def evaluate(replay: Replay, residuals: bool = True, progress: FrameProgress | None = None) -> Evaluation:
    """See `evaluate_run`."""
    run, model = replay.run, HandModel(replay.hand)
    points, truth_metrics = _against_truth(run, model, replay.sequence.ground_truth)
    metrics = [*truth_metrics]
    if residuals:
        replayed: Iterable[ReplayedFrame] = replay if progress is None else progress(replay)
        metrics += run_residuals(replayed, replay.surface(), len(run.index)).metrics()
    metrics.append(jitter(model.endpoints(run.poses), run.timestamps))
    return Evaluation(
        run,
        replay.configuration,
        replay.sequence.name,
        tuple(metrics),
        points,
        None if points is None else SuccessCurve.of(points),
        find_losses(run.status, run.timestamps),
        frame_time(run.stage_ms, len(run.index)),
        stage_times(run.stage_ms, len(run.index)),
    )


def _against_truth(
    run: Run, model: HandModel, truth: GroundTruth | None
) -> tuple[PointErrors | None, tuple[Metric, ...]]:
    """Errors against true poses where the recording knows them, else against its annotated joints."""
    if truth is None:
        return None, ()
    rows = [truth.at(float(t)) for t in run.timestamps]
    if truth.poses is not None:
        true_poses = _taken(truth.poses, rows)
        true_model = model if truth.hand is None else HandModel(truth.hand)
        points = endpoint_errors(model, run.poses, true_model, true_poses)
        added = added_jitter(model.endpoints(run.poses), true_model.endpoints(true_poses), run.timestamps)
        return points, (points.mean(), points.largest(), angle_error(run.poses, true_poses), added)
    if truth.joints is not None:
        points = joint_errors(model, run.poses, _taken(truth.joints, rows))
        return points, (points.mean(), points.largest())
    return None, ()


def _taken(values: Array, rows: list[int | None]) -> Array:
    """The rows of `values` (N, ...), NaN where there is none."""
    nowhere = np.full(values.shape[1:], np.nan)
    return np.array([nowhere if row is None else values[row] for row in rows]).reshape(-1, *values.shape[1:])
