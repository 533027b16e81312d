"""Rotations of the 16 joints from rest, for skeletons without joint frames (BVH, MANO).

At rest the frames of all joints are parallel. A rotation relative to the parent turns a joint and what follows it from
there.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from depthtrack.hand.kinematics import JOINT_NAMES, HandModel
from depthtrack.hand.pose import make_pose
from depthtrack.types import Array

JOINT_PARENTS = (-1, *(0 if number % 3 == 1 else number - 1 for number in range(1, len(JOINT_NAMES))))
"""Number (16,) of the joint before each of `JOINT_NAMES`, -1 for the wrist."""


@dataclass(frozen=True)
class RestSkeleton:
    """The joints of a hand at rest, with axes of choice.

    R_palm_axes: (3, 3) the axes in the palm's frame.
    pose: (27,) at rest, the palm's frame.
    joints: (16, 3) of `JOINT_NAMES` from the wrist, metres, in these axes.
    tips: (5, 3) fingertips in the same way.
    """

    model: HandModel
    R_palm_axes: Array
    pose: Array
    joints: Array
    tips: Array

    @classmethod
    def of(cls, model: HandModel, R_palm_axes: Array, angles: Array | None = None) -> Self:
        """Return the skeleton of a hand.

        angles: (20,) posture at rest, rad; a flat hand if absent.
        """
        pose = make_pose([0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], np.zeros(20) if angles is None else angles)
        joints, tips = (points - model.shape.wrist for points in (model.joints(pose), model.endpoints(pose)[3::4]))
        return cls(model, R_palm_axes, pose, joints @ R_palm_axes, tips @ R_palm_axes)

    @property
    def offsets(self) -> Array:
        """Return the joints (16, 3) from their parents; the wrist's is zero."""
        return np.concatenate([self.joints[:1], self.joints[1:] - self.joints[list(JOINT_PARENTS[1:])]])

    def rotations(self, poses: Array) -> Array:
        """Return the rotations (T, 16, 3, 3) of poses (T, 27).

        That of the wrist is in the frame of the poses, the others are relative to their parents.
        """
        rest = self.model.transforms(self.pose)[:, :3, :3]
        turned = self.model.transforms(poses)[..., :3, :3] @ rest.swapaxes(-1, -2) @ self.R_palm_axes
        local = turned.copy()
        local[:, 1:] = turned[:, list(JOINT_PARENTS[1:])].swapaxes(-1, -2) @ turned[:, 1:]
        return local
