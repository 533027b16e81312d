"""How long each frame took, and each of its stages."""

from collections.abc import Mapping

import numpy as np

from depthtrack.evaluation.metrics.metric import Metric
from depthtrack.types import Array


def frame_time(stage_ms: Mapping[str, Array], frames: int) -> Metric:
    """Milliseconds a frame, the sum of its stages (T,), by the wall clock of the machine that made the run."""
    stages = [metric.values for metric in stage_times(stage_ms, frames).values()]
    total = np.sum(stages, axis=0) if stages else np.full(frames, np.nan)
    return Metric("ms_per_frame", "ms", np.asarray(total, dtype=np.float64))


def stage_times(stage_ms: Mapping[str, Array], frames: int) -> dict[str, Metric]:
    """Milliseconds of each stage, in the order in which they run; NaN for frames whose times were not kept."""
    return {stage: Metric(f"{stage}_ms", "ms", _padded(values, frames)) for stage, values in stage_ms.items()}


def _padded(values: Array, frames: int) -> Array:
    out = np.full(frames, np.nan)
    out[: len(values)] = values[:frames]
    return out
