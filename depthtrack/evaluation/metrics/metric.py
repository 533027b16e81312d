"""A metric with one value per frame, its unit and its statistics."""

from dataclasses import dataclass

import numpy as np

from depthtrack.types import Array

Statistics = dict[str, float | None]
"""Values by name: "mean", "median", "p95" and "max", or "p05" and "min" if higher is better; None without a frame."""


@dataclass(frozen=True)
class Metric:
    """A metric with one value per frame.

    name: key in JSON, which contains the unit.
    unit: unit of the values; "" for a ratio.
    values: (T,); NaN if the frame has no value.
    higher_is_better: whether a perfect tracker has the largest value.
    """

    name: str
    unit: str
    values: Array
    higher_is_better: bool = False

    def statistics(self) -> Statistics:
        """Return mean, median, 95th percentile and maximum, or 5th percentile and minimum."""
        judged = self.judged
        tail, worst, percent = ("p05", "min", 5) if self.higher_is_better else ("p95", "max", 95)
        if len(judged) == 0:
            return dict.fromkeys(("mean", "median", tail, worst))
        return {
            "mean": float(judged.mean()),
            "median": float(np.median(judged)),
            tail: float(np.percentile(judged, percent)),
            worst: float(np.percentile(judged, 0 if self.higher_is_better else 100)),
        }

    @property
    def judged(self) -> Array:
        """Finite values (N,)."""
        return self.values[np.isfinite(self.values)]
