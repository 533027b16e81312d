"""How long each frame took, and each of its stages."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from depthtrack.evaluation.metrics.metric import Metric

Array = NDArray[np.float64]


def frame_time(stage_ms: Mapping[str, Array], frames: int) -> Metric:
    """Milliseconds a frame, the sum of its stages (T,), by the wall clock of the machine that made the run."""
    total = np.sum(list(stage_ms.values()), axis=0) if stage_ms else np.full(frames, np.nan)
    return Metric("ms_per_frame", "ms", np.asarray(total, dtype=np.float64))


def stage_times(stage_ms: Mapping[str, Array]) -> dict[str, Metric]:
    """Milliseconds of each stage, in the order in which they run."""
    return {stage: Metric(f"{stage}_ms", "ms", values) for stage, values in stage_ms.items()}
