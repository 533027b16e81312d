"""A figure a frame, with its unit and its statistics."""

from dataclasses import dataclass

import numpy as np

from depthtrack.types import Array

Statistics = dict[str, float | None]
"""Keys "mean", "median", "p95" and "max", or "p05" and "min" where higher is better; None without a judged frame."""


@dataclass(frozen=True)
class Metric:
    """One figure a frame: `values` (T,) in `unit`; `name` as it stands in JSON, with the unit in it.

    `unit` is "" for a ratio. `higher_is_better` where a perfect tracker has the largest value.
    """

    name: str
    unit: str
    values: Array
    higher_is_better: bool = False

    def statistics(self) -> Statistics:
        """Mean, median, and what the worst 5 % of the frames begin and end with; None without a judged frame."""
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
        """The values (N,) of the frames that could be judged."""
        return self.values[np.isfinite(self.values)]
