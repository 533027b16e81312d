"""Errors without the constant offsets between the joints of two hand models."""

import numpy as np

from depthtrack.hand.kinematics import KEYPOINT_BODIES, HandModel
from depthtrack.types import Array


def without_offsets(model: HandModel, poses: Array, joints: Array) -> Array:
    """Return the keypoints (T, 21, 3), metres, of poses without their constant offsets.

    poses: (T, 27); NaN if unknown.
    joints: (T, 21, 3) metres, camera frame; NaN if unknown.

    Models of different make place joints differently within the same flesh. The offset of a joint is its median
    difference over all frames, in the frame of the bone that moves it.
    """
    keypoints, R = np.full((len(poses), 21, 3), np.nan), np.full((len(poses), 21, 3, 3), np.nan)
    known = np.isfinite(poses).all(axis=1)
    keypoints[known] = model.keypoints(poses[known])
    R[known] = model.transforms(poses[known])[:, KEYPOINT_BODIES, :3, :3]
    local = np.einsum("tjab,tja->tjb", R, keypoints - joints)
    usable = np.isfinite(local).all(axis=(1, 2))
    if not usable.any():
        return keypoints
    return np.asarray(keypoints - np.einsum("tjab,jb->tja", R, np.median(local[usable], axis=0)))
