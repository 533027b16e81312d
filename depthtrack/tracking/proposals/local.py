"""Second thoughts about a pose that explains little: other fingers, another place close by.

Descents and swarms move a finger through its neighbours' places only with luck: an open finger that is taken for a bent
one, or for the next, stays so for many frames. What other postures would look like, the renderer tells in microseconds.
"""

import numpy as np

from depthtrack.geometry.alignment import rigid_alignment
from depthtrack.geometry.rotations import quaternion_exp, quaternion_from_matrix, quaternion_product, rotation_matrix
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.limits import LOWER, UPPER, within_limits
from depthtrack.hand.pose import ANGLES, ORIENTATION, POSITION, make_pose
from depthtrack.hand.postures import POSTURES
from depthtrack.hand.reference_kinematics import reference_transforms
from depthtrack.rendering.scorer import Scorer
from depthtrack.types import Array

_HOOKED = np.radians([[0, 20, 40, 60], *([0, 10, 95, 60] for _ in range(4))])
_LOWERED = np.radians([[10, 20, 10, 5], *([0, 70, 15, 10] for _ in range(4))])
_FINGERS = np.stack(
    [*(POSTURES[name].reshape(5, 4) for name in ("open", "relaxed", "grasp", "fist")), _HOOKED, _LOWERED]
)
"""(K, 5, 4) postures of single fingers."""
_PLACE, _TURN, _VARIED = 0.02, 0.3, 0.15
"""Metres, and radians of the whole hand and of each angle, by which what is close by differs: standard deviations."""

_FINGER_TRIALS, _FINGER_KEPT, _FINGER_SPREADS = 96, 8, (0.2, 0.1)
"""Postures of one finger that are looked at together, how many of them lead on, and how far from these the next ones
are: standard deviations, radians."""


def local_proposals(pose: Array, generator: np.random.Generator, count: int) -> Array:
    """Poses (count, 27) of hands close to where the one in `pose` (27,) is, every finger in some typical posture; in
    every fourth, those of `pose` are kept."""
    shift, turn = generator.standard_normal((2, count, 3)) * [[[_PLACE]], [[_TURN]]]
    mixed = _FINGERS[generator.integers(0, len(_FINGERS), (count, 5)), np.arange(5)].reshape(count, 20)
    kept = (np.arange(count) % 4 == 0)[:, None]
    angles = np.where(kept, pose[ANGLES], mixed) + _VARIED * generator.standard_normal((count, 20))
    quaternions = quaternion_product(quaternion_exp(turn), pose[ORIENTATION])
    return within_limits(make_pose(pose[POSITION] + shift, quaternions, angles))


def search_one_finger(scorer: Scorer, pose: Array, finger: int, generator: np.random.Generator) -> tuple[Array, float]:
    """The pose (27,) that explains the observation best if but one finger (0 to 4) of `pose` (27,) is elsewhere, and
    its energy: among typical and random postures of it, and twice around the best of them."""
    limits = slice(4 * finger, 4 * finger + 4)
    angles = slice(ANGLES.start + limits.start, ANGLES.start + limits.stop)
    anywhere = generator.uniform(LOWER[limits], UPPER[limits], (_FINGER_TRIALS - len(_FINGERS), 4))
    poses = np.tile(pose, (_FINGER_TRIALS, 1))
    poses[:, angles] = np.concatenate([_FINGERS[:, finger], anywhere])
    best, energies = _best(scorer, poses)
    for spread in _FINGER_SPREADS:
        poses = np.tile(best, (_FINGER_TRIALS // _FINGER_KEPT, 1))
        poses[_FINGER_KEPT:, angles] += spread * generator.standard_normal((len(poses) - _FINGER_KEPT, 4))
        best, energies = _best(scorer, poses)
    return best[0], float(energies[0])


def _best(scorer: Scorer, poses: Array) -> tuple[Array, Array]:
    """The best few of some poses (N, 27), within the limits, and their energies."""
    poses = within_limits(poses)
    energies = scorer.score(poses)
    best = np.argsort(energies, kind="stable")[:_FINGER_KEPT]
    return poses[best], energies[best]


def finger_shift_proposals(model: HandModel, pose: Array) -> Array:
    """Poses (2, 27) of the hand in `pose` (27,) with each finger where the next one was, one way and the other: what
    remains of a hand that was found one finger beside where it is. The thumb, and a finger that has none beside it on
    that side, go along."""

    # The reference kinematics: the last bits of these points reach the tracked poses.
    def endpoints(of: Array) -> Array:
        return model.endpoints_of(reference_transforms(model.chain, of)).reshape(5, 4, 3)

    there = endpoints(pose)
    poses = np.tile(pose, (2, 1))
    for other, mine, next_ones in zip(poses, ([1, 2, 3], [2, 3, 4]), ([2, 3, 4], [1, 2, 3]), strict=True):
        angles = pose[ANGLES].reshape(5, 4).copy()
        angles[mine] = angles[next_ones]
        other[ANGLES] = angles.ravel()
        R, t = rigid_alignment(endpoints(other)[mine].reshape(-1, 3), there[next_ones].reshape(-1, 3))
        turned = quaternion_from_matrix(R @ rotation_matrix(pose[ORIENTATION]))
        other[:] = make_pose(R @ pose[POSITION] + t, turned, other[ANGLES])
    return within_limits(poses)
