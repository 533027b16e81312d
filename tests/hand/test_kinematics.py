"""Kinematics of both sides and batches; Jacobians agree with finite differences."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.geometry.rotations import rotation_matrix
from depthtrack.hand.compiled_kinematics import BODY_COUNT
from depthtrack.hand.kinematics import ENDPOINT_NAMES, KEYPOINT_NAMES, MOVES, HandModel, body_of
from depthtrack.hand.limits import LOWER, UPPER, within_limits
from depthtrack.hand.pose import ANGLE_NAMES, ANGLES, make_pose, retract
from depthtrack.hand.shape import HandShape, Side
from tests.support.hands import random_pose_in_view

SIDES: tuple[Side, Side] = ("right", "left")


def angles(**degrees: float) -> np.ndarray:
    values = np.zeros(20)
    for name, value in degrees.items():
        values[ANGLE_NAMES.index(name)] = np.radians(value)
    return values


@pytest.mark.parametrize("side", SIDES)
@given(seed=st.integers(0, 2**32 - 1), scale=st.floats(0.5, 1.5))
def test_jacobian_equals_finite_differences(side: Side, seed: int, scale: float) -> None:
    rng = np.random.default_rng(seed)
    model, pose = HandModel(HandShape(side=side, scale=scale)), random_pose_in_view(seed)
    bodies, local = rng.integers(0, BODY_COUNT, 12), rng.normal(scale=0.03, size=(12, 3))
    J = model.point_jacobian(pose, bodies, model.transform_points(pose, bodies, local))
    step = 1e-6
    for column in range(26):
        tangent = np.zeros(26)
        tangent[column] = step
        ahead = model.transform_points(retract(pose, tangent), bodies, local)
        behind = model.transform_points(retract(pose, -tangent), bodies, local)
        np.testing.assert_allclose(J[..., column], (ahead - behind) / (2 * step), atol=2e-8)


def test_batches_equal_single_poses() -> None:
    model, poses = HandModel(HandShape()), random_pose_in_view(1, 2, 3)
    bodies = np.arange(BODY_COUNT)
    local = np.random.default_rng(0).normal(size=(BODY_COUNT, 3))
    points = model.transform_points(poses, bodies, local)
    jacobians = model.point_jacobian(poses, bodies, points)
    for i in np.ndindex(2, 3):
        np.testing.assert_allclose(model.transforms(poses)[i], model.transforms(poses[i]), atol=1e-15)
        np.testing.assert_allclose(model.keypoints(poses)[i], model.keypoints(poses[i]), atol=1e-15)
        np.testing.assert_allclose(jacobians[i], model.point_jacobian(poses[i], bodies, points[i]), atol=1e-15)


@given(seed=st.integers(0, 2**32 - 1))
def test_left_hand_is_the_mirror_of_the_right(seed: int) -> None:
    finger_angles = random_pose_in_view(seed)[ANGLES]
    identity = make_pose(np.zeros(3), [1, 0, 0, 0], finger_angles)
    right, left = (HandModel(HandShape(side=side)).keypoints(identity) for side in SIDES)
    np.testing.assert_allclose(left, right * [-1, 1, 1], atol=1e-15)


@given(seed=st.integers(0, 2**32 - 1))
def test_bones_keep_their_length(seed: int) -> None:
    shape = HandShape(scale=1.1)
    points = HandModel(shape).endpoints(random_pose_in_view(seed)).reshape(5, 4, 3)
    np.testing.assert_allclose(np.linalg.norm(np.diff(points, axis=1), axis=-1), shape.lengths * 1.1, atol=1e-12)


@given(seed=st.integers(0, 2**32 - 1))
def test_endpoints_and_joints_agree_with_the_transforms(seed: int) -> None:
    model, pose = HandModel(HandShape()), random_pose_in_view(seed)
    T, keypoints, joints = model.transforms(pose), model.keypoints(pose), model.joints(pose)
    np.testing.assert_allclose(
        T[:, :3, :3] @ np.swapaxes(T[:, :3, :3], -1, -2), np.tile(np.eye(3), (16, 1, 1)), atol=1e-12
    )
    np.testing.assert_allclose(joints[0], keypoints[0])
    for name, body in (("thumb_cmc", body_of(0, 0)), ("index_pip", body_of(1, 1)), ("little_dip", body_of(4, 2))):
        np.testing.assert_allclose(keypoints[KEYPOINT_NAMES.index(name)], joints[body])
    np.testing.assert_allclose(keypoints[0], rotation_matrix(pose[3:7]) @ model.shape.wrist + pose[:3])


@pytest.mark.parametrize("side", SIDES)
def test_signs_of_the_angles(side: Side) -> None:
    """Flexion moves a fingertip to the palmar side; abduction moves it towards the thumb."""
    model = HandModel(HandShape(side=side))
    at_rest = model.endpoints(make_pose(np.zeros(3), [1, 0, 0, 0], np.zeros(20)))
    tip = {name: at_rest[ENDPOINT_NAMES.index(f"{name}_tip")] for name in ("thumb", "index")}

    def moved(name: str, **degrees: float) -> np.ndarray:
        points = model.endpoints(make_pose(np.zeros(3), [1, 0, 0, 0], angles(**degrees)))
        return points[ENDPOINT_NAMES.index(f"{name}_tip")] - tip[name]

    towards_thumb = np.sign(tip["thumb"][0])
    assert towards_thumb == (1 if side == "right" else -1)
    assert moved("index", index_mcp_flexion=30)[2] > 0.02
    assert moved("index", index_mcp_abduction=15)[0] * towards_thumb > 0.015
    assert moved("thumb", thumb_cmc_abduction=20)[2] > 0.01
    assert moved("thumb", thumb_cmc_flexion=20)[0] * towards_thumb < -0.01
    assert moved("thumb", thumb_ip_flexion=60)[0] * towards_thumb < -0.005


def test_moves_names_the_ancestors() -> None:
    index = slice(4, 8)
    assert MOVES[body_of(1, 0), index].tolist() == [True, True, False, False]
    assert MOVES[body_of(1, 2), index].tolist() == [True] * 4
    assert not MOVES[0].any()
    assert not MOVES[body_of(2, 2), index].any()


@given(seed=st.integers(0, 2**32 - 1))
def test_within_limits_clips_to_the_range(seed: int) -> None:
    rng = np.random.default_rng(seed)
    pose = make_pose(rng.normal(size=3), rng.normal(size=4), rng.uniform(-3, 3, 20))
    nearest = within_limits(pose)
    inside = (pose[ANGLES] >= LOWER) & (pose[ANGLES] <= UPPER)
    assert np.all((nearest[ANGLES] >= LOWER) & (nearest[ANGLES] <= UPPER))
    np.testing.assert_array_equal(nearest[ANGLES][inside], pose[ANGLES][inside])
    np.testing.assert_array_equal(nearest[:7], pose[:7])
