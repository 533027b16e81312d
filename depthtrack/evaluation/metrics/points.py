"""Errors of tracked points: phalanx endpoints of true poses, or annotated joints."""

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
    """Distances of points from their true positions.

    metric: name of the mean error, "endpoint_error_mm" or "joint_error_mm".
    names: (P,) names of the points.
    mm: (T, P) distances, mm; NaN without ground truth or estimate.
    known: (T,) frames with ground truth; those without an estimate count as missed.
    """

    metric: str
    names: tuple[str, ...]
    mm: Array
    known: Mask

    @classmethod
    def between(cls, metric: str, names: tuple[str, ...], points: ArrayLike, true_points: ArrayLike) -> Self:
        """Return the errors of points.

        points, true_points: (T, P, 3), m, in one frame; NaN if unknown.
        """
        truth = np.asarray(true_points, dtype=np.float64)
        distances = np.linalg.norm(np.asarray(points, dtype=np.float64) - truth, axis=-1)
        known = np.asarray(np.isfinite(truth).all(axis=-1).any(axis=-1), dtype=np.bool_)
        return cls(metric, names, 1000 * distances, known)

    def mean(self) -> Metric:
        """Return the mean over the points of each frame, mm.

        For endpoints, its mean over all frames is the error Delta of Oikonomidis et al. 2011, Sec. 3.
        """
        return Metric(self.metric, "mm", _reduced(np.nanmean, self.mm))

    def largest(self) -> Metric:
        """Return the largest error of each frame, mm.

        It decides success in Taylor et al., "The Vitruvian manifold", CVPR 2012.
        """
        return Metric(f"largest_{self.metric}", "mm", _reduced(np.nanmax, self.mm))

    def of_finger(self, finger: str) -> Metric:
        """Return the mean over the points of one finger of `pose.FINGERS` in each frame, mm."""
        columns = [k for k, name in enumerate(self.names) if name.startswith(f"{finger}_")]
        return Metric(f"{finger}_{self.metric}", "mm", _reduced(np.nanmean, self.mm[:, columns]))

    def by_finger(self) -> dict[str, Metric]:
        """Return `of_finger` of all fingers, in the order of `pose.FINGERS`."""
        return {finger: self.of_finger(finger) for finger in FINGERS}


def endpoint_errors(model: HandModel, poses: Array, true_model: HandModel, true_poses: Array) -> PointErrors:
    """Return the errors of the 20 phalanx endpoints (Oikonomidis et al. 2011, Sec. 3).

    poses, true_poses: (T, 27); NaN if unknown.
    """
    return PointErrors.between(
        "endpoint_error_mm", ENDPOINT_NAMES, model.endpoints(poses), true_model.endpoints(true_poses)
    )


def endpoint_error(model: HandModel, poses: Array, true_model: HandModel, true_poses: Array) -> Metric:
    """Return the mean of `endpoint_errors` in each frame, mm."""
    return endpoint_errors(model, poses, true_model, true_poses).mean()


def joint_errors(model: HandModel, poses: Array, joints: Array, names: tuple[str, ...] = KEYPOINT_NAMES) -> PointErrors:
    """Return the errors of keypoints relative to annotated joints of the same names.

    poses: (T, 27); NaN if unknown.
    joints: (T, J, 3), m, camera frame; NaN if unknown.
    names: (J,) any of `kinematics.KEYPOINT_NAMES`.

    The mean over joints and frames is the mean joint error of Oberweger, Wohlhart and Lepetit, "Hands deep in deep
    learning", CVWW 2015. It includes the offset between the joints of two skeletons.
    """
    order = [KEYPOINT_NAMES.index(name) for name in names]
    return PointErrors.between("joint_error_mm", names, model.keypoints(poses)[:, order], joints)


def angle_error(poses: Array, true_poses: Array) -> Metric:
    """Return the mean absolute error of the 20 finger angles in each frame, degrees.

    poses, true_poses: (T, 27); NaN if unknown.

    Source: Schroeder et al. 2014, Sec. VI.
    """
    difference = np.abs(poses[..., ANGLES] - true_poses[..., ANGLES])
    return Metric("angle_error_deg", "deg", np.degrees(difference.mean(axis=-1)))


def _reduced(reduce: Callable[..., Any], values: Array) -> Array:
    """Return `reduce` over the finite columns of each row; NaN for a row without any."""
    known = np.isfinite(values).any(axis=1)
    out = np.full(len(values), np.nan)
    if known.any():
        out[known] = reduce(values[known], axis=1)
    return out
