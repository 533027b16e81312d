"""Other people's predictions against a benchmark's labels, or against a recording's annotated joints."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from depthtrack.errors import InputError
from depthtrack.evaluation.metrics import Metric, PointErrors, SuccessCurve
from depthtrack.export.benchmark_joints import Benchmark
from depthtrack.export.uvd import read_uvd
from depthtrack.hand.kinematics import KEYPOINT_NAMES
from depthtrack.recording.sequence import Sequence
from depthtrack.types import Array


@dataclass(frozen=True)
class PredictionEvaluation:
    """Errors of the joints of a file of predictions; rows are its lines.

    `success` counts frames without a prediction as missed; it is None where nothing is known of any frame.
    """

    predictions: Path
    benchmark: Benchmark
    points: PointErrors
    success: SuccessCurve | None

    @property
    def frames(self) -> int:
        return len(self.points.mm)

    @property
    def missed_frames(self) -> int:
        """Frames that have labels, but no predicted joint."""
        return int(np.sum(self.points.known & ~np.isfinite(self.points.mm).any(axis=1)))

    @property
    def left_out_joints(self) -> int:
        """Joints without a position, here or in the labels, in frames that are judged by their others."""
        judged = np.isfinite(self.points.mm).any(axis=1)
        return int(np.sum(~np.isfinite(self.points.mm[judged])))

    @property
    def by_joint(self) -> dict[str, Metric]:
        """The error of each joint, mm, in the benchmark's order."""
        columns = zip(self.points.names, self.points.mm.T, strict=True)
        return {name: Metric(f"{name}_error_mm", "mm", column) for name, column in columns}

    def to_json(self) -> dict[str, Any]:
        """Statistics of every metric; keys carry the unit."""
        mean, largest = self.points.mean(), self.points.largest()
        return {
            "predictions": str(self.predictions),
            "benchmark": self.benchmark.name,
            "frames": self.frames,
            "missed_frames": self.missed_frames,
            "left_out_joints": self.left_out_joints,
            mean.name: mean.statistics(),
            largest.name: largest.statistics(),
            "finger_joint_error_mm": {name: metric.statistics() for name, metric in self.points.by_finger().items()},
            "joint_error_mm_by_joint": {name: metric.statistics() for name, metric in self.by_joint.items()},
            **({} if self.success is None else self.success.to_json()),
        }


def evaluate_predictions(predictions: Path, benchmark: Benchmark, truth: Path | Sequence) -> PredictionEvaluation:
    """Hold a file of predictions against a file of labels in the same format, line by line, or against a recording.

    Of a recording, line k is frame k; it may have more frames than the file has lines. Raises InputError.
    """
    found = read_uvd(predictions, benchmark)
    if isinstance(truth, Path):
        known = read_uvd(truth, benchmark)
        if len(known) != len(found):
            raise InputError(
                f"{predictions} has {len(found)} frames, but {truth} has {len(known)}: they must be of the same ones"
            )
    else:
        known = _annotated(truth, benchmark)
        if len(known) < len(found):
            raise InputError(f"{predictions} has {len(found)} frames, but {truth.name} has only {len(known)}")
    points = PointErrors.between("joint_error_mm", benchmark.joints, found, known[: len(found)])
    return PredictionEvaluation(predictions, benchmark, points, SuccessCurve.of(points))


def _annotated(sequence: Sequence, benchmark: Benchmark) -> Array:
    """The benchmark's joints (T, J, 3) of every frame of a recording, NaN where they are not known."""
    truth = sequence.ground_truth
    known = [None if truth is None else truth.keypoints_at(float(time)) for time in sequence.timestamps]
    if all(keypoints is None for keypoints in known):
        raise InputError(f"{sequence.name} knows no joints to compare with: give --labels")
    nowhere = np.full((len(KEYPOINT_NAMES), 3), np.nan)
    return benchmark.from_keypoints([nowhere if keypoints is None else keypoints for keypoints in known])
