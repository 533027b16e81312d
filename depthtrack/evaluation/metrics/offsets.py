"""Errors without the constant offsets between the joints of two hand models."""

import numpy as np

from depthtrack.hand.kinematics import KEYPOINT_BODIES, HandModel
from depthtrack.types import Array, Mask


def without_offsets(model: HandModel, poses: Array, joints: Array) -> Array:
    """Return the keypoints (T, 21, 3), metres, of poses without their constant offsets.

    poses: (T, 27); NaN if unknown.
    joints: (T, 21, 3) metres, camera frame; NaN if unknown.
    """
    return corrected_keypoints(model, poses, joint_offsets(model, poses, joints))


def joint_offsets(model: HandModel, poses: Array, joints: Array, counted: Mask | None = None) -> Array:
    """Return the constant offsets (21, 3) of poses, metres.

    Each is in the frame of the bone that moves the joint.

    poses, joints: as in `without_offsets`.
    counted: (T, 21) joints that count; all if None.

    Models of different make place joints differently within the same flesh. The offset of a joint is its median
    difference over all frames; zero without any.
    """
    keypoints, R = _keypoints_and_bones(model, poses)
    local = np.einsum("tjab,tja->tjb", R, keypoints - joints)
    usable = np.isfinite(local).all(axis=(1, 2))[:, None] & (np.ones((1, 21), np.bool_) if counted is None else counted)
    medians = [np.median(local[usable[:, j], j], axis=0) if usable[:, j].any() else np.zeros(3) for j in range(21)]
    return np.array(medians)


def corrected_keypoints(model: HandModel, poses: Array, offsets: Array) -> Array:
    """Return the keypoints (T, 21, 3), metres, of poses without given offsets.

    poses: (T, 27); NaN if unknown.
    offsets: (21, 3) of `joint_offsets`.
    """
    keypoints, R = _keypoints_and_bones(model, poses)
    return np.asarray(keypoints - np.einsum("tjab,jb->tja", R, offsets))


def _keypoints_and_bones(model: HandModel, poses: Array) -> tuple[Array, Array]:
    """Return the keypoints (T, 21, 3) and the orientations of their bones (T, 21, 3, 3).

    Those of unknown poses are NaN.
    """
    keypoints, R = np.full((len(poses), 21, 3), np.nan), np.full((len(poses), 21, 3, 3), np.nan)
    known = np.isfinite(poses).all(axis=1)
    keypoints[known] = model.keypoints(poses[known])
    R[known] = model.transforms(poses[known])[:, KEYPOINT_BODIES, :3, :3]
    return keypoints, R
