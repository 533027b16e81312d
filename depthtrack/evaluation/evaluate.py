"""A run held against its recording: what `depthtrack evaluate` reports."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthtrack.errors import InputError
from depthtrack.evaluation.metrics import Metric, angle_error, endpoint_error
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape
from depthtrack.recording.run import Run
from depthtrack.recording.sequence import GroundTruth

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Evaluation:
    """Figures of one run: `metrics` a row a frame each; `lost_frames` without a trusted pose, of `frames`."""

    run: Run
    metrics: tuple[Metric, ...]
    ms_per_frame: Metric
    lost_frames: int

    @property
    def frames(self) -> int:
        return len(self.run.index)

    def to_json(self) -> dict[str, Any]:
        """Statistics of every metric; keys carry the unit."""
        stages = {stage: float(np.median(ms)) for stage, ms in self.run.stage_ms.items() if len(ms)}
        return {
            "run": str(self.run.folder),
            "tracker": self.run.configuration.get("tracker"),
            "frames": self.frames,
            "lost_frames": self.lost_frames,
            **{metric.name: metric.statistics() for metric in self.metrics},
            "ms_per_frame": self.ms_per_frame.statistics(),
            "stage_ms_median": stages,
        }


def evaluate(run: Run, truth: GroundTruth | None) -> Evaluation:
    """Compare a run with what its recording knows. Raises InputError where that has no poses to compare with."""
    total = np.sum(list(run.stage_ms.values()), axis=0) if run.stage_ms else np.zeros(len(run.index))
    lost = sum(status in ("lost", "absent") for status in run.status)
    metrics = () if truth is None or truth.poses is None else _pose_metrics(run, truth)
    return Evaluation(run, metrics, Metric("ms_per_frame", "ms", np.asarray(total, dtype=np.float64)), lost)


def _pose_metrics(run: Run, truth: GroundTruth) -> tuple[Metric, ...]:
    assert truth.poses is not None
    rows = [truth.at(float(t)) for t in run.timestamps]
    true_poses = np.array([np.full(27, np.nan) if row is None else truth.poses[row] for row in rows]).reshape(-1, 27)
    model = HandModel(run_hand(run))
    true_model = model if truth.hand is None else HandModel(truth.hand)
    return endpoint_error(model, run.poses, true_model, true_poses), angle_error(run.poses, true_poses)


def run_hand(run: Run) -> HandShape:
    """The hand that a run was tracked with. Raises InputError."""
    try:
        return HandShape.from_fields(run.configuration["hand"])
    except (KeyError, TypeError, ValueError, AttributeError, InputError) as error:
        raise InputError(f"{run.folder / 'run.json'} names no usable hand: {error}") from error


def recorded_sequence(run: Run) -> Path:
    """Where the run's recording was. Raises InputError when run.json does not say."""
    path = run.configuration.get("sequence")
    if not isinstance(path, str):
        raise InputError(f"{run.folder / 'run.json'} does not say which recording it tracked: give --sequence")
    return Path(path)
