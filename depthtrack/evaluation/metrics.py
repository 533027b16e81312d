"""Errors of tracked poses against the truth; every metric knows its unit.

Arrays have a row a frame, NaN where a frame cannot be judged (no pose, or no truth).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import ANGLES

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Metric:
    """One figure a frame: `values` (T,) in `unit`; `name` as it stands in JSON, with the unit in it."""

    name: str
    unit: str
    values: Array

    def statistics(self) -> dict[str, float | None]:
        """Mean, median, 95th percentile and maximum over the frames that could be judged; None without any."""
        judged = self.values[np.isfinite(self.values)]
        if len(judged) == 0:
            return {"mean": None, "median": None, "p95": None, "max": None}
        return {
            "mean": float(judged.mean()),
            "median": float(np.median(judged)),
            "p95": float(np.percentile(judged, 95)),
            "max": float(judged.max()),
        }


def endpoint_error(model: HandModel, poses: Array, true_model: HandModel, true_poses: Array) -> Metric:
    """Mean distance of the 20 phalanx endpoints to the true ones, each frame, mm (Oikonomidis et al. 2011, Sec. 3).

    `poses`, `true_poses` (T, 27). The mean over all frames is the papers' error estimate Delta.
    """
    distances = np.linalg.norm(model.endpoints(poses) - true_model.endpoints(true_poses), axis=-1)
    return Metric("endpoint_error_mm", "mm", 1000 * distances.mean(axis=-1))


def angle_error(poses: Array, true_poses: Array) -> Metric:
    """Mean absolute difference of the 20 finger angles, each frame, degrees (Schroeder et al. 2014, Sec. VI)."""
    difference = np.abs(poses[..., ANGLES] - true_poses[..., ANGLES])
    return Metric("angle_error_deg", "deg", np.degrees(difference.mean(axis=-1)))
