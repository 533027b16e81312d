"""The share of frames that are good enough, for every idea of good enough."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from depthtrack.evaluation.metrics.points import PointErrors
from depthtrack.types import Array

LIMIT_MM = 50.0
"""Upper end of the curve, and of the area under it."""
REPORTED_MM = (10, 20, 30, 40)


@dataclass(frozen=True)
class SuccessCurve:
    """Share of the frames whose largest error is under each threshold (Taylor et al., CVPR 2012).

    `thresholds_mm`, `shares` (K,), from 0 to LIMIT_MM; `auc` the area under the curve there, 1 for a perfect tracker;
    `frames` judged, of which those with a truth but without an estimate never succeed. `errors_mm` (frames,) are the
    largest errors themselves, infinite without an estimate.
    """

    thresholds_mm: Array
    shares: Array
    auc: float
    frames: int
    errors_mm: Array

    @classmethod
    def of(cls, errors: PointErrors) -> Self | None:
        """The curve of a track; None without a frame to judge."""
        largest = errors.largest().values[errors.known]
        if len(largest) == 0:
            return None
        largest = np.where(np.isfinite(largest), largest, np.inf)
        thresholds = np.arange(LIMIT_MM + 1)
        shares = np.array([share_within(largest, threshold) for threshold in thresholds])
        # The share is a staircase that rises by 1 / frames at each error: its area is exact without sampling.
        auc = float(np.clip(1 - largest / LIMIT_MM, 0, 1).mean())
        return cls(thresholds, shares, auc, len(largest), largest)

    def within(self, threshold_mm: float) -> float:
        """Share of the frames whose largest error is under `threshold_mm`."""
        return share_within(self.errors_mm, threshold_mm)

    def to_json(self) -> dict[str, Any]:
        """Shares at the usual thresholds, the area, and up to where it is taken."""
        return {
            "frames_within_mm": {str(threshold): self.within(threshold) for threshold in REPORTED_MM},
            "frames_within_auc": self.auc,
            "frames_within_auc_limit_mm": LIMIT_MM,
        }


def share_within(errors: Array, threshold: float) -> float:
    """Share of `errors` (N,) under `threshold`."""
    return float(np.mean(errors < threshold))
