"""Rotations from rest place the joints by forward kinematics, in any axes, for both hands."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.openxr_joints import R_BODY_JOINT
from depthtrack.hand.rest_rotations import JOINT_PARENTS, RestSkeleton
from depthtrack.hand.shape import HandShape, Side
from tests.support.tracks import moving_poses


@given(st.integers(0, 1000), st.sampled_from(("right", "left")), st.booleans())
def test_forward_kinematics_gives_joints_and_tips(seed: int, side: Side, turned: bool) -> None:
    model, poses = HandModel(HandShape(side=side)), moving_poses(3, seed)
    rest = RestSkeleton.of(model, R_BODY_JOINT, poses[1, 7:]) if turned else RestSkeleton.of(model, np.eye(3))
    local, wrist = rest.rotations(poses), model.wrist(poses)
    np.testing.assert_allclose(local @ local.swapaxes(-1, -2), np.broadcast_to(np.eye(3), local.shape), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(local), 1)
    placed, world = np.empty((3, 16, 3)), local.copy()
    placed[:, 0] = wrist
    for joint, parent in enumerate(JOINT_PARENTS):
        if parent >= 0:
            world[:, joint] = world[:, parent] @ local[:, joint]
            placed[:, joint] = placed[:, parent] + world[:, parent] @ rest.offsets[joint]
    np.testing.assert_allclose(placed, model.joints(poses), atol=1e-12)
    tips = placed[:, 3::3] + np.einsum("tfij,fj->tfi", world[:, 3::3], rest.tips - rest.joints[3::3])
    np.testing.assert_allclose(tips, model.endpoints(poses)[:, 3::4], atol=1e-12)


def test_a_flat_hand_has_no_rotations() -> None:
    rest = RestSkeleton.of(HandModel(HandShape(side="left")), R_BODY_JOINT)
    pose = moving_poses(1)
    pose[:, 7:] = 0
    np.testing.assert_allclose(rest.rotations(pose)[:, 1:], np.broadcast_to(np.eye(3), (1, 15, 3, 3)), atol=1e-12)
