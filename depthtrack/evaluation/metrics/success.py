"""Success curve: the share of frames below each error threshold."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from depthtrack.evaluation.metrics.points import PointErrors
from depthtrack.types import Array

LIMIT_MM = 50.0
"""Upper end of the curve and of the area under it, mm."""
REPORTED_MM = (10, 20, 30, 40)
"""Thresholds to report, mm."""


@dataclass(frozen=True)
class SuccessCurve:
    """Share of frames whose largest error is below each threshold (Taylor et al., CVPR 2012).

    thresholds_mm: (K,) from 0 to LIMIT_MM.
    shares: (K,).
    auc: area under the curve up to LIMIT_MM; 1 for a perfect tracker.
    frames: number of frames with ground truth.
    errors_mm: (frames,) largest error of each frame; infinite without an estimate.
    """

    thresholds_mm: Array
    shares: Array
    auc: float
    frames: int
    errors_mm: Array

    @classmethod
    def of(cls, errors: PointErrors) -> Self | None:
        """Return the curve of a track; None without ground truth."""
        largest = errors.largest().values[errors.known]
        if len(largest) == 0:
            return None
        largest = np.where(np.isfinite(largest), largest, np.inf)
        thresholds = np.arange(LIMIT_MM + 1)
        shares = np.array([share_within(largest, threshold) for threshold in thresholds])
        # The share is a step function that rises by 1 / frames at each error, so its area is exact.
        auc = float(np.clip(1 - largest / LIMIT_MM, 0, 1).mean())
        return cls(thresholds, shares, auc, len(largest), largest)

    def within(self, threshold_mm: float) -> float:
        """Return the share of the frames whose largest error is below `threshold_mm`."""
        return share_within(self.errors_mm, threshold_mm)

    def to_json(self) -> dict[str, Any]:
        """Return the shares at REPORTED_MM, the area and its limit as JSON values."""
        return {
            "frames_within_mm": {str(threshold): self.within(threshold) for threshold in REPORTED_MM},
            "frames_within_auc": self.auc,
            "frames_within_auc_limit_mm": LIMIT_MM,
        }


def share_within(errors: Array, threshold: float) -> float:
    """Return the share of `errors` (N,) below `threshold`."""
    return float(np.mean(errors < threshold))
