"""Evaluate prediction files of public benchmarks on labels or on annotated recordings."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from depthtrack.errors import InputError
from depthtrack.evaluation.metrics import Metric, PointErrors, SuccessCurve
from depthtrack.export.uvd import read_uvd
from depthtrack.hand.benchmark_joints import Benchmark
from depthtrack.hand.kinematics import KEYPOINT_NAMES
from depthtrack.recording.sequence import Sequence
from depthtrack.types import Array


@dataclass(frozen=True)
class PredictionEvaluation:
    """Errors of the joints in a prediction file; rows are its lines.

    predictions: path of the file.
    points: errors of the joints.
    success: curve of the frames below each error, frames without prediction included; None without ground truth.
    """

    predictions: Path
    benchmark: Benchmark
    points: PointErrors
    success: SuccessCurve | None

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(self.points.mm)

    @property
    def missed_frames(self) -> int:
        """Number of frames that have labels but no predicted joint."""
        return int(np.sum(self.points.known & ~np.isfinite(self.points.mm).any(axis=1)))

    @property
    def left_out_joints(self) -> int:
        """Number of joints without a prediction or label, in frames that have others with both."""
        judged = np.isfinite(self.points.mm).any(axis=1)
        return int(np.sum(~np.isfinite(self.points.mm[judged])))

    @property
    def by_joint(self) -> dict[str, Metric]:
        """Error of each joint, mm, in the order of the benchmark."""
        columns = zip(self.points.names, self.points.mm.T, strict=True)
        return {name: Metric(f"{name}_error_mm", "mm", column) for name, column in columns}

    def to_json(self) -> dict[str, Any]:
        """Return the statistics of all metrics as JSON values; keys contain the unit."""
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
    """Return the evaluation of a prediction file.

    predictions: file with one line per frame.
    benchmark: joints, order and camera of the files.
    truth: label file in the same format, or a recording. Line k belongs to frame k of the recording, which may have
        more frames.

    Raises:
        InputError: if a file is malformed, the frames do not match, or the recording has no joints.
    """
    found = read_uvd(predictions, benchmark)
    if isinstance(truth, Path):
        known = read_uvd(truth, benchmark)
        if len(known) != len(found):
            raise InputError(
                f"{predictions} has {len(found)} frames, but {truth} has {len(known)}: give files of the same frames"
            )
    else:
        known = _annotated(truth, benchmark)
        if len(known) < len(found):
            raise InputError(
                f"{predictions} has {len(found)} frames, but {truth.name} has only {len(known)}: give another recording"
            )
    points = PointErrors.between("joint_error_mm", benchmark.joints, found, known[: len(found)])
    return PredictionEvaluation(predictions, benchmark, points, SuccessCurve.of(points))


def _annotated(sequence: Sequence, benchmark: Benchmark) -> Array:
    """Return the joints (T, J, 3) of the benchmark in all frames of a recording; NaN if unknown."""
    truth = sequence.ground_truth
    if truth is not None and truth.benchmark is not None and truth.benchmark.benchmark.name == benchmark.name:
        rows = [truth.at(float(time)) for time in sequence.timestamps]
        unknown = np.full((len(benchmark.joints), 3), np.nan)
        return np.array([unknown if row is None else truth.benchmark.positions[row] for row in rows])
    known = [None if truth is None else truth.keypoints_at(float(time)) for time in sequence.timestamps]
    if all(keypoints is None for keypoints in known):
        raise InputError(f"{sequence.name} has no joints to compare with: give --labels")
    absent = np.full((len(KEYPOINT_NAMES), 3), np.nan)
    return benchmark.from_keypoints([absent if keypoints is None else keypoints for keypoints in known])
