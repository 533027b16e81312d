"""Time of each frame and of its stages."""

from collections.abc import Mapping

import numpy as np

from depthtrack.evaluation.metrics.metric import Metric
from depthtrack.types import Array


def frame_time(stage_ms: Mapping[str, Array], frames: int) -> Metric:
    """Return the time of each frame, the sum over its stages, ms.

    stage_ms: (T,) times by stage, ms; shorter if the run was interrupted.
    frames: number of frames T of the run.
    """
    stages = [metric.values for metric in stage_times(stage_ms, frames).values()]
    total = np.sum(stages, axis=0) if stages else np.full(frames, np.nan)
    return Metric("ms_per_frame", "ms", np.asarray(total, dtype=np.float64))


def stage_times(stage_ms: Mapping[str, Array], frames: int) -> dict[str, Metric]:
    """Return the time of each stage in each frame, ms; NaN for frames without stored times."""
    return {stage: Metric(f"{stage}_ms", "ms", _padded(values, frames)) for stage, values in stage_ms.items()}


def _padded(values: Array, frames: int) -> Array:
    """Return values (frames,), padded with NaN."""
    out = np.full(frames, np.nan)
    out[: len(values)] = values[:frames]
    return out
