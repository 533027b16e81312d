"""Proposals near a known pose: other palm poses, and a typical posture of each finger."""

import numpy as np

from depthtrack.geometry.rotations import quaternion_exp, quaternion_product
from depthtrack.hand.limits import within_limits
from depthtrack.hand.pose import ANGLES, ORIENTATION, POSITION, make_pose
from depthtrack.tracking.options import RecoveryOptions
from depthtrack.tracking.proposals.fingers import FINGER_POSTURES
from depthtrack.types import Array


def local_proposals(pose: Array, generator: np.random.Generator, options: RecoveryOptions) -> Array:
    """Return poses (N, 27) near `pose` (27,).

    They cover what swarms and descents rarely reach: a finger on the other side of its neighbours.
    """
    count, spreads = options.proposals, [[[options.position_spread]], [[options.rotation_spread]]]
    shift, turn = generator.standard_normal((2, count, 3)) * spreads
    mixed = FINGER_POSTURES[generator.integers(0, len(FINGER_POSTURES), (count, 5)), np.arange(5)].reshape(count, 20)
    kept = (np.arange(count) % options.keep_angles_every == 0)[:, None]
    angles = np.where(kept, pose[ANGLES], mixed) + options.angle_spread * generator.standard_normal((count, 20))
    quaternions = quaternion_product(quaternion_exp(turn), pose[ORIENTATION])
    return within_limits(make_pose(pose[POSITION] + shift, quaternions, angles))
