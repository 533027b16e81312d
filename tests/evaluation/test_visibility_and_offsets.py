"""Errors of visible and hidden points, and errors without constant offsets."""

import numpy as np

from depthtrack.evaluation.metrics import joint_errors, visible_and_hidden, within_spread, without_offsets
from depthtrack.evaluation.metrics.offsets import joint_offsets
from depthtrack.geometry.camera import Camera
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.visibility import points_in_view
from depthtrack.synthesis.generate import Synthesis, Synthesiser

CAMERA = Camera(40, 30, 50.0, 50.0, 20.0, 15.0)


def test_a_point_behind_a_surface_or_outside_the_image_is_hidden() -> None:
    depth = np.zeros(CAMERA.shape, dtype=np.float32)
    depth[:, :20] = 0.5
    points = np.array([[-0.05, 0, 0.51], [-0.05, 0, 0.55], [0.05, 0, 0.9], [5, 0, 0.5], [np.nan] * 3])
    assert points_in_view(points, depth, CAMERA).tolist() == [True, False, True, False, False]


def test_the_joints_of_an_open_hand_are_visible_and_those_of_a_fist_are_not() -> None:
    made = Synthesiser(Synthesis(motion="everyday", model="skin"))
    shares = []
    for index in (0, 330):
        shown = made[index]
        shares.append(points_in_view(shown.joints, shown.exact_depth.astype(np.float32), made.sensor.camera).mean())
    assert shares[0] == 1
    assert shares[1] < 1


def test_errors_are_split_by_visibility() -> None:
    model, poses = HandModel(HandShape()), Synthesiser(Synthesis(frames=2)).poses
    joints = model.keypoints(poses)
    joints[:, 8] += [0.01, 0, 0]
    visible = np.ones((2, 21), dtype=np.bool_)
    visible[1, 8] = False
    shown, hidden = visible_and_hidden(joint_errors(model, poses, joints), visible)
    np.testing.assert_allclose(shown.values, [10 / 21, 0], atol=1e-9)
    np.testing.assert_allclose(hidden.values, [np.nan, 10], atol=1e-9)
    assert (shown.name, hidden.name) == ("visible_joint_error_mm", "hidden_joint_error_mm")


def test_errors_are_compared_with_their_spread() -> None:
    model, poses = HandModel(HandShape()), Synthesiser(Synthesis(frames=3)).poses
    joints = model.keypoints(poses)
    joints[:, 8] += [0.01, 0, 0]
    spread, visible = np.full((3, 21), 0.005), np.ones((3, 21), dtype=np.bool_)
    spread[1, 8], spread[2], visible[1, 7:9] = 0.02, np.nan, False
    shown, hidden = within_spread(joint_errors(model, poses, joints), spread, visible)
    np.testing.assert_allclose(shown.values, [20 / 21, 1, np.nan])
    np.testing.assert_allclose(hidden.values, [np.nan, 1, np.nan])


def test_joints_of_another_hand_differ_by_constant_offsets_alone() -> None:
    made = Synthesiser(Synthesis(motion="signs", frames=60))
    ours = HandModel(HandShape())
    joints = ours.keypoints(made.poses)
    R = ours.transforms(made.poses)[:, 0, :3, :3]
    joints[:, 0] += np.einsum("tab,b->ta", R, [0.002, -0.004, 0.003])  # another wrist, fixed to the palm
    found = without_offsets(ours, made.poses, joints)
    np.testing.assert_allclose(found, joints, atol=1e-9)
    moved = made.poses.copy()
    moved[7] = np.nan
    assert np.isnan(without_offsets(ours, moved, joints)[7]).all()


def test_a_hand_that_is_never_known_stays_unknown() -> None:
    unknown = np.full((3, 27), np.nan)
    assert np.isnan(without_offsets(HandModel(HandShape()), unknown, np.zeros((3, 21, 3)))).all()


def test_joints_that_do_not_count_leave_the_offsets_as_they_are() -> None:
    made, ours = Synthesiser(Synthesis(motion="signs", frames=20)), HandModel(HandShape())
    joints, counted = ours.keypoints(made.poses), np.ones((20, 21), dtype=np.bool_)
    joints[:15, 8] += 0.05
    counted[:15, 8], counted[:, 3] = False, False
    np.testing.assert_allclose(joint_offsets(ours, made.poses, joints, counted), 0, atol=1e-12)
    assert np.linalg.norm(joint_offsets(ours, made.poses, joints)[8]) > 0.04
