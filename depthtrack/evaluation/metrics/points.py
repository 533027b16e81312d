"""Distances of tracked points from true ones: phalanx endpoints of true poses, or annotated joints."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from depthtrack.evaluation.metrics.metric import Metric
from depthtrack.hand.kinematics import ENDPOINT_NAMES, KEYPOINT_NAMES, HandModel
from depthtrack.hand.pose import ANGLES, FINGERS
from depthtrack.types import Array, Mask


@dataclass(frozen=True)
class PointErrors:
    """Distances `mm` (T, P) of the points `names` (P,) from the true ones, millimetres.

    NaN where a point of a frame has no truth or no estimate; `known` (T,) says where there is a truth to judge by, so
    that a frame without an estimate can count as missed. `metric` is what their mean is called: "endpoint_error_mm"
    or "joint_error_mm".
    """

    metric: str
    names: tuple[str, ...]
    mm: Array
    known: Mask

    @classmethod
    def between(cls, metric: str, names: tuple[str, ...], points: ArrayLike, true_points: ArrayLike) -> Self:
        """Of points (T, P, 3) in metres, NaN rows where there are none."""
        truth = np.asarray(true_points, dtype=np.float64)
        distances = np.linalg.norm(np.asarray(points, dtype=np.float64) - truth, axis=-1)
        known = np.asarray(np.isfinite(truth).all(axis=-1).any(axis=-1), dtype=np.bool_)
        return cls(metric, names, 1000 * distances, known)

    def mean(self) -> Metric:
        """Mean over the points, each frame, mm. For endpoints, its mean over all frames is the error estimate Delta of
        Oikonomidis et al. 2011, Sec. 3."""
        return Metric(self.metric, "mm", _reduced(np.nanmean, self.mm))

    def largest(self) -> Metric:
        """The largest over the points, each frame, mm: what success is judged by in Taylor et al., "The Vitruvian
        manifold", CVPR 2012."""
        return Metric(f"largest_{self.metric}", "mm", _reduced(np.nanmax, self.mm))

    def of_finger(self, finger: str) -> Metric:
        """Mean over the points of one of `pose.FINGERS`, each frame, mm."""
        columns = [k for k, name in enumerate(self.names) if name.startswith(f"{finger}_")]
        return Metric(f"{finger}_{self.metric}", "mm", _reduced(np.nanmean, self.mm[:, columns]))

    def by_finger(self) -> dict[str, Metric]:
        """`of_finger` for all of `pose.FINGERS`, in order."""
        return {finger: self.of_finger(finger) for finger in FINGERS}


def endpoint_errors(model: HandModel, poses: Array, true_model: HandModel, true_poses: Array) -> PointErrors:
    """Distances of the 20 phalanx endpoints from the true ones (Oikonomidis et al. 2011, Sec. 3).

    `poses`, `true_poses` (T, 27), NaN rows where there is none.
    """
    return PointErrors.between(
        "endpoint_error_mm", ENDPOINT_NAMES, model.endpoints(poses), true_model.endpoints(true_poses)
    )


def endpoint_error(model: HandModel, poses: Array, true_model: HandModel, true_poses: Array) -> Metric:
    """Mean of `endpoint_errors`, each frame, mm."""
    return endpoint_errors(model, poses, true_model, true_poses).mean()


def joint_errors(model: HandModel, poses: Array, joints: Array, names: tuple[str, ...] = KEYPOINT_NAMES) -> PointErrors:
    """Distances of keypoints from annotated joints of the same names, whatever skeleton they come from.

    `poses` (T, 27), `joints` (T, J, 3) metres, camera frame, NaN where unknown; `names` (J,) of
    `kinematics.KEYPOINT_NAMES`, any of them in any order. The mean over joints and frames is the "mean joint error" of
    Oberweger, Wohlhart and Lepetit, "Hands deep in deep learning", CVWW 2015. Where skeletons place joints
    differently, that difference is in the error.
    """
    order = [KEYPOINT_NAMES.index(name) for name in names]
    return PointErrors.between("joint_error_mm", names, model.keypoints(poses)[:, order], joints)


def angle_error(poses: Array, true_poses: Array) -> Metric:
    """Mean absolute difference of the 20 finger angles, each frame, degrees (Schroeder et al. 2014, Sec. VI)."""
    difference = np.abs(poses[..., ANGLES] - true_poses[..., ANGLES])
    return Metric("angle_error_deg", "deg", np.degrees(difference.mean(axis=-1)))


def _reduced(reduce: Callable[..., Any], values: Array) -> Array:
    """`reduce` over the known columns of each row; NaN for a row without any."""
    known = np.isfinite(values).any(axis=1)
    out = np.full(len(values), np.nan)
    if known.any():
        out[known] = reduce(values[known], axis=1)
    return out
