"""Proposals near a known pose: other palm poses close by, every finger in some typical posture."""

import numpy as np

from depthtrack.geometry.rotations import quaternion_exp, quaternion_product
from depthtrack.hand.limits import within_limits
from depthtrack.hand.pose import ANGLES, ORIENTATION, POSITION, make_pose
from depthtrack.tracking.proposals.fingers import FINGER_POSTURES
from depthtrack.types import Array

POSITION_SPREAD, ROTATION_SPREAD, ANGLE_SPREAD = 0.02, 0.3, 0.15
"""Standard deviations about the known pose: metres, radians, radians."""
KEPT_EVERY = 4
"""Every n-th proposal keeps the finger angles of the known pose."""


def local_proposals(pose: Array, generator: np.random.Generator, count: int) -> Array:
    """Return poses (count, 27) near `pose` (27,): swarms and descents rarely move a finger past its neighbours."""
    shift, turn = generator.standard_normal((2, count, 3)) * [[[POSITION_SPREAD]], [[ROTATION_SPREAD]]]
    mixed = FINGER_POSTURES[generator.integers(0, len(FINGER_POSTURES), (count, 5)), np.arange(5)].reshape(count, 20)
    kept = (np.arange(count) % KEPT_EVERY == 0)[:, None]
    angles = np.where(kept, pose[ANGLES], mixed) + ANGLE_SPREAD * generator.standard_normal((count, 20))
    quaternions = quaternion_product(quaternion_exp(turn), pose[ORIENTATION])
    return within_limits(make_pose(pose[POSITION] + shift, quaternions, angles))
