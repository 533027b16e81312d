"""Proposals of finger postures: other postures of one finger, and shifted fingers."""

import numpy as np

from depthtrack.geometry.alignment import rigid_alignment
from depthtrack.geometry.rotations import quaternion_from_matrix, rotation_matrix
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.limits import LOWER, UPPER, within_limits
from depthtrack.hand.pose import ANGLES, ORIENTATION, POSITION, make_pose
from depthtrack.hand.postures import POSTURES
from depthtrack.rendering.scorer import Scorer
from depthtrack.tracking.candidate import Candidate, evaluate, poses_of
from depthtrack.tracking.options import FingerOptions
from depthtrack.types import Array

_HOOKED = np.radians([[0, 20, 40, 60], *([0, 10, 95, 60] for _ in range(4))])
_LOWERED = np.radians([[10, 20, 10, 5], *([0, 70, 15, 10] for _ in range(4))])
FINGER_POSTURES = np.stack(
    [*(POSTURES[name].reshape(5, 4) for name in ("open", "relaxed", "grasp", "fist")), _HOOKED, _LOWERED]
)
"""(K, 5, 4) typical postures of each finger, rad."""


def search_one_finger(
    scorer: Scorer, pose: Array, finger: int, generator: np.random.Generator, options: FingerOptions
) -> Candidate:
    """Return the best candidate that differs from `pose` (27,) in one finger (0 to 4).

    Typical and random postures of the finger are scored first, then perturbations of the best ones.
    """
    limits = slice(4 * finger, 4 * finger + 4)
    angles = slice(ANGLES.start + limits.start, ANGLES.start + limits.stop)
    random = generator.uniform(LOWER[limits], UPPER[limits], (options.proposals - len(FINGER_POSTURES), 4))
    poses = np.tile(pose, (options.proposals, 1))
    poses[:, angles] = np.concatenate([FINGER_POSTURES[:, finger], random])
    best = evaluate(scorer, within_limits(poses))[: options.kept]
    for spread in options.spreads:
        poses = np.tile(poses_of(best), (options.proposals // options.kept, 1))[options.kept :]
        poses[:, angles] += spread * generator.standard_normal((len(poses), 4))
        best = sorted([*best, *evaluate(scorer, within_limits(poses))], key=lambda c: c.energy)[: options.kept]
    return best[0]


def finger_shift_proposals(model: HandModel, pose: Array) -> Array:
    """Return poses (2, 27) with the fingers shifted by one place in both directions.

    They correct a hand that was matched one finger beside its place. The thumb moves along. So does a finger without a
    neighbour on that side.
    """
    there = model.endpoints(pose).reshape(5, 4, 3)
    poses = np.tile(pose, (2, 1))
    for other, fingers, neighbours in zip(poses, ([1, 2, 3], [2, 3, 4]), ([2, 3, 4], [1, 2, 3]), strict=True):
        angles = pose[ANGLES].reshape(5, 4).copy()
        angles[fingers] = angles[neighbours]
        other[ANGLES] = angles.ravel()
        R, t = rigid_alignment(
            model.endpoints(other).reshape(5, 4, 3)[fingers].reshape(-1, 3), there[neighbours].reshape(-1, 3)
        )
        turned = quaternion_from_matrix(R @ rotation_matrix(pose[ORIENTATION]))
        other[:] = make_pose(R @ pose[POSITION] + t, turned, other[ANGLES])
    return within_limits(poses)
