"""Reliability of the confidence: does it separate good estimates from bad ones?"""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from scipy.stats import rankdata

from depthtrack.types import Array, Mask

SMALL = 20.0
"""Largest error of a point, mm, of a good estimate."""
BINS = 10


def auroc(score: Array, good: Mask) -> float | None:
    """Return the area under the ROC curve of a score (N,); None if all or none are good."""
    positive, negative = int(good.sum()), int((~good).sum())
    if positive == 0 or negative == 0:
        return None
    return float((rankdata(score)[good].sum() - positive * (positive + 1) / 2) / (positive * negative))


@dataclass(frozen=True)
class Reliability:
    """Comparison of the confidence with the errors of the frames that have both.

    frames: number of such frames.
    good: share whose largest error is below `SMALL`.
    auroc: area under the ROC curve for that; None if all or none are good.
    bins: lower end of the confidence, number of frames and share of good ones, for each bin with frames.
    """

    frames: int
    good: float
    auroc: float | None
    bins: tuple[tuple[float, int, float], ...]

    @classmethod
    def of(cls, confidence: Array, largest_mm: Array) -> Self | None:
        """Return the reliability of confidences (T,) with errors (T,), mm; None without any frame."""
        known = np.isfinite(confidence) & np.isfinite(largest_mm)
        if not known.any():
            return None
        score, good = confidence[known], largest_mm[known] < SMALL
        number = np.minimum((score * BINS).astype(int), BINS - 1)
        bins = [(k / BINS, good[number == k]) for k in range(BINS)]
        filled = tuple((low, len(part), float(part.mean())) for low, part in bins if len(part))
        return cls(len(score), float(good.mean()), auroc(score, good), filled)

    def to_json(self) -> dict[str, Any]:
        """Return the figures as JSON values."""
        bins = [{"from": low, "frames": count, "good": good} for low, count, good in self.bins]
        return {"frames": self.frames, "good": self.good, "auroc": self.auroc, "bins": bins}
