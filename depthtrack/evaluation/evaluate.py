"""Evaluate a run on its recording, as `depthtrack evaluate` reports it."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from depthtrack.evaluation.metrics import (
    Losses,
    Metric,
    PointErrors,
    Reliability,
    SuccessCurve,
    added_jitter,
    angle_error,
    endpoint_errors,
    find_losses,
    frame_time,
    jitter,
    joint_errors,
    stage_times,
    visible_and_hidden,
    within_spread,
)
from depthtrack.evaluation.replay import Replay, ReplayedFrame
from depthtrack.evaluation.residuals import run_residuals
from depthtrack.hand.kinematics import HandModel
from depthtrack.recording.run_folder import Run
from depthtrack.recording.sequence import GroundTruth
from depthtrack.rendering.visibility import points_in_view
from depthtrack.tracking.run_configuration import RunConfiguration
from depthtrack.types import Array, Mask

FrameProgress = Callable[[Iterable[ReplayedFrame]], Iterable[ReplayedFrame]]
"""Wraps the replayed frames, as a progress bar does."""


@dataclass(frozen=True)
class Evaluation:
    """All metrics of one run; rows are the frames of the run.

    recording: name of the recording.
    metrics: metrics with one value per frame, in the order to print; first those that need ground truth.
    points: errors of endpoints or annotated joints; None without ground truth.
    success: curve of the frames below each error; None without ground truth.
    reliability: of the confidence; None without ground truth or without a confidence.
    losses: losses that the tracker reported.
    ms_per_frame: milliseconds per frame.
    stage_ms: milliseconds per frame of each stage.
    """

    run: Run
    configuration: RunConfiguration
    recording: str
    metrics: tuple[Metric, ...]
    points: PointErrors | None
    success: SuccessCurve | None
    reliability: Reliability | None
    losses: Losses
    ms_per_frame: Metric
    stage_ms: dict[str, Metric]

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(self.run.index)

    @property
    def lost_frames(self) -> int:
        """Number of frames without a trusted pose: lost, or without an observed hand."""
        return int(self.losses.lost.sum() + self.losses.absent.sum())

    @property
    def finger_errors(self) -> dict[str, Metric]:
        """Error of each finger of `pose.FINGERS`, mm; empty without ground truth."""
        return {} if self.points is None else self.points.by_finger()

    def metric(self, name: str) -> Metric | None:
        """Return the metric of this name; None if the recording does not allow it."""
        return next((metric for metric in self.metrics if metric.name == name), None)

    def to_json(self) -> dict[str, Any]:
        """Return the statistics of all metrics as JSON values; keys contain the unit."""
        fingers = {finger: metric.statistics() for finger, metric in self.finger_errors.items()}
        return {
            "run": str(self.run.folder),
            "recording": self.recording,
            "tracker": self.configuration.tracker.name,
            "frames": self.frames,
            **self.losses.to_json(),
            "failed_frames": len(self.run.failures),
            **{metric.name: metric.statistics() for metric in self.metrics},
            **({} if self.points is None else {f"finger_{self.points.metric}": fingers}),
            **({} if self.success is None else self.success.to_json()),
            **({} if self.reliability is None else {"confidence": self.reliability.to_json()}),
            "ms_per_frame": self.ms_per_frame.statistics(),
            "stage_ms": {stage: metric.statistics() for stage, metric in self.stage_ms.items()},
        }


def evaluate_run(
    folder: Path, sequence: Path | None = None, residuals: bool = True, progress: FrameProgress | None = None
) -> Evaluation:
    """Return the evaluation of the run in `folder`.

    sequence: path of the recording, if it was moved.
    residuals: compute E3D, E2D and IoU, which segments every frame again; no effect without depth images.
    progress: wraps the frames while the residuals are computed.

    Raises:
        InputError: if the run or its recording is missing or malformed, or they do not belong together.
    """
    return evaluate(Replay.open(Run.load(folder), sequence), residuals, progress)


def evaluate(replay: Replay, residuals: bool = True, progress: FrameProgress | None = None) -> Evaluation:
    """Return the evaluation of an opened run; see `evaluate_run`."""
    run, model = replay.run, HandModel(replay.hand)
    true_points, points, truth_metrics = _pose_errors(run, model, replay.sequence.ground_truth)
    metrics = [*truth_metrics]
    if points is not None and (visible := _visible(replay, true_points)) is not None:
        metrics += visible_and_hidden(points, visible)
        if np.isfinite(run.spread).any():
            metrics += within_spread(points, run.spread, visible)
    if residuals and replay.sequence.has_depth:
        replayed: Iterable[ReplayedFrame] = replay if progress is None else progress(replay)
        metrics += run_residuals(replayed, replay.surface(), len(run.index)).metrics()
    metrics.append(jitter(model.endpoints(run.poses), run.timestamps))
    return Evaluation(
        run=run,
        configuration=replay.configuration,
        recording=replay.sequence.name,
        metrics=tuple(metrics),
        points=points,
        success=None if points is None else SuccessCurve.of(points),
        reliability=None if points is None else Reliability.of(run.confidence, points.largest().values),
        losses=find_losses(run.status, run.timestamps),
        ms_per_frame=frame_time(run.stage_ms, len(run.index)),
        stage_ms=stage_times(run.stage_ms, len(run.index)),
    )


def _visible(replay: Replay, points: Array) -> Mask | None:
    """Return which true points (T, P) are visible; None if the recording has no exact depth."""
    found = np.zeros(points.shape[:2], dtype=np.bool_)
    for row, index in enumerate(map(int, replay.run.index)):
        depth = replay.sequence.exact_depth(index)
        if depth is None:
            return None
        found[row] = points_in_view(points[row], depth, replay.sequence.camera)
    return found


def _pose_errors(
    run: Run, model: HandModel, truth: GroundTruth | None
) -> tuple[Array, PointErrors | None, tuple[Metric, ...]]:
    """Return the true points (T, P, 3), and the errors relative to poses or joints."""
    nothing = np.empty((0, 0, 3)), None, ()
    if truth is None:
        return nothing
    rows = [truth.at(float(t)) for t in run.timestamps]
    if truth.poses is not None:
        true_poses = _select_rows(truth.poses, rows)
        true_model = model if truth.hand is None else HandModel(truth.hand)
        points, true_points = (
            endpoint_errors(model, run.poses, true_model, true_poses),
            true_model.endpoints(true_poses),
        )
        added = added_jitter(model.endpoints(run.poses), true_points, run.timestamps)
        return true_points, points, (points.mean(), points.largest(), angle_error(run.poses, true_poses), added)
    if truth.benchmark is not None:
        benchmark = truth.benchmark.benchmark
        joints = _select_rows(truth.benchmark.positions, rows)
        points = PointErrors.between(
            "joint_error_mm", benchmark.joints, benchmark.from_keypoints(model.keypoints(run.poses)), joints
        )
        return joints, points, (points.mean(), points.largest())
    if truth.joints is not None:
        joints = _select_rows(truth.joints, rows)
        points = joint_errors(model, run.poses, joints)
        return joints, points, (points.mean(), points.largest())
    return nothing


def _select_rows(values: Array, rows: list[int | None]) -> Array:
    """Return rows of `values` (N, ...); NaN for None."""
    absent = np.full(values.shape[1:], np.nan)
    return np.array([absent if row is None else values[row] for row in rows]).reshape(-1, *values.shape[1:])
