"""Forward kinematics in plain numpy, the reference of the tests.

The skin is built with it too, so that its bits do not depend on the compiled kinematics.
"""

import numpy as np
from numpy.typing import ArrayLike

from depthtrack.geometry.rotations import rotation_matrix
from depthtrack.hand.compiled_kinematics import BODY_COUNT, Chain
from depthtrack.hand.pose import ANGLES, ORIENTATION, POSITION
from depthtrack.types import Array


def reference_transforms(chain: Chain, pose: ArrayLike) -> Array:
    """Return T_camera_body (..., 16, 4, 4), metres, of poses (..., 27); see `HandModel`."""
    p = np.asarray(pose, dtype=np.float64)
    batch = p.shape[:-1]
    T = np.zeros((*batch, BODY_COUNT, 4, 4))
    T[..., 3, 3] = 1
    T[..., 0, :3, :3] = rotation_matrix(p[..., ORIENTATION])
    T[..., 0, :3, 3] = p[..., POSITION]
    angles = p[..., ANGLES].reshape(*batch, 5, 4)
    for finger in range(5):
        local = np.zeros((*batch, 4, 4))
        local[..., 3, 3] = 1
        local[..., :3, :3] = chain.base[finger, :, :3] @ _rotation_z(-chain.mirror * angles[..., finger, 0])
        local[..., :3, 3] = chain.base[finger, :, 3]
        parent = T[..., 0, :, :] @ local
        for phalanx in range(3):
            here = parent @ _rotation_x(angles[..., finger, 1 + phalanx])
            T[..., 1 + 3 * finger + phalanx, :, :] = here
            along = np.eye(4)
            along[1, 3] = chain.lengths[finger, phalanx]
            parent = here @ along
    return T


def _rotation_x(angle: Array) -> Array:
    """Return the transforms (..., 4, 4) of turns about x."""
    T = np.zeros((*angle.shape, 4, 4))
    T[..., 0, 0] = T[..., 3, 3] = 1
    T[..., 1, 1] = T[..., 2, 2] = np.cos(angle)
    T[..., 1, 2], T[..., 2, 1] = -np.sin(angle), np.sin(angle)
    return T


def _rotation_z(angle: Array) -> Array:
    """Return the rotation matrices (..., 3, 3) of turns about z."""
    R = np.zeros((*angle.shape, 3, 3))
    R[..., 2, 2] = 1
    R[..., 0, 0] = R[..., 1, 1] = np.cos(angle)
    R[..., 0, 1], R[..., 1, 0] = -np.sin(angle), np.sin(angle)
    return R
