"""Fit of the hand to 21 keypoints: inverse kinematics with known correspondences.

Source: Schroeder et al. 2014, Sec. IV-A.

Keypoints are those of `kinematics.KEYPOINT_NAMES`, the wrist first; a missing one is NaN.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from depthtrack.hand.kinematics import KEYPOINT_BODIES, KEYPOINT_NAMES, HandModel
from depthtrack.hand.pose import POSE_SIZE, make_pose
from depthtrack.hand.postures import POSTURES
from depthtrack.solver.point_fit import PointFitOptions, aligned_poses, fit_points_each
from depthtrack.types import Array, Mask

IN_PALM = np.array([0, 1, 5, 9, 13, 17])
"""Wrist and base joints: they move with the palm alone."""


@dataclass(frozen=True)
class KeypointFitOptions:
    """Starts and tolerances of a keypoint fit.

    finger_weight: weight of the keypoints outside the palm in the rigid alignment at the start, against 1: enough if
    those of the palm are missing. points: the fit from there.
    """

    finger_weight: float = 0.01
    points: PointFitOptions = field(default_factory=PointFitOptions)


@dataclass(frozen=True)
class FittedPoses:
    """Poses fitted to keypoints; NaN for hands with fewer than three known ones.

    poses: (N, 27) within the limits.
    residuals: (N,) root mean square distance to the known keypoints, metres.
    """

    poses: Array
    residuals: Array


def fit_poses(model: HandModel, keypoints: ArrayLike, options: KeypointFitOptions | None = None) -> FittedPoses:
    """Return the poses with keypoints closest to the given ones.

    keypoints: (N, 21, 3) metres, camera frame.

    Each fit starts at a relaxed hand, aligned rigidly. Hands with missing finger joints are fitted from a fist too,
    and the better pose is kept.
    """
    options = options or KeypointFitOptions()
    targets = np.asarray(keypoints, dtype=np.float64).reshape(-1, len(KEYPOINT_NAMES), 3)
    poses, residuals = np.full((len(targets), POSE_SIZE), np.nan), np.full(len(targets), np.nan)
    known = is_known(targets)
    usable = np.flatnonzero(known.sum(axis=-1) >= 3)
    filled = np.where(known[..., None], targets, 0)
    with_gaps = usable[~known[usable, 1:].all(axis=-1)]
    alignment_weights = np.full(len(KEYPOINT_NAMES), options.finger_weight)
    alignment_weights[IN_PALM] = 1
    local = local_keypoints(model)
    for posture, hands in (("relaxed", usable), ("fist", with_gaps)):
        if not len(hands):
            continue
        angles = POSTURES[posture]
        points = model.keypoints(make_pose(np.zeros(3), (1, 0, 0, 0), angles))
        starts = aligned_poses(angles, points, filled[hands], alignment_weights * known[hands])
        fitted, energies = fit_points_each(
            model.chain, KEYPOINT_BODIES, local, filled[hands], known[hands].astype(np.float64), starts, options.points
        )
        residual = np.sqrt(2 * energies / known[hands].sum(axis=-1))
        better = ~(residual >= residuals[hands])  # than another start, or than none
        poses[hands[better]], residuals[hands[better]] = fitted[better], residual[better]
    return FittedPoses(poses, residuals)


def local_keypoints(model: HandModel) -> Array:
    """Return the keypoints (21, 3), metres, in the frames of the bodies of `KEYPOINT_BODIES`."""
    pose = make_pose(np.zeros(3), (1, 0, 0, 0), np.zeros(20))
    T = model.transforms(pose)[KEYPOINT_BODIES]
    return np.asarray(np.einsum("nji,nj->ni", T[:, :3, :3], model.keypoints(pose) - T[:, :3, 3]))


def is_known(points: Array) -> Mask:
    """Return whether each point (..., 3) has all its coordinates (...)."""
    return np.asarray(np.isfinite(points).all(axis=-1), dtype=np.bool_)
