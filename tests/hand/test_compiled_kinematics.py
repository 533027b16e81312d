"""The compiled kinematics agree with the reference in plain numpy."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.hand import compiled_kinematics
from depthtrack.hand.compiled_kinematics import BodyPoses, Chain
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import ORIENTATION
from depthtrack.hand.reference_kinematics import reference_transforms
from depthtrack.hand.shape import HandShape, Side
from tests.support.hands import random_pose

SEEDS = st.integers(0, 2**32 - 1)


@pytest.mark.parametrize("side", ["right", "left"])
@given(seed=SEEDS)
def test_bodies_and_hinges_are_those_of_the_hand_model(side: Side, seed: int) -> None:
    shape, rng = HandShape(side=side, scale=1.2), np.random.default_rng(seed)
    pose, model = random_pose(rng), HandModel(shape)
    bodies, T = BodyPoses.at(Chain.of(shape), pose), reference_transforms(Chain.of(shape), pose)
    np.testing.assert_allclose(bodies.T, T[:, :3], atol=1e-12)
    # A point of each body moves with each angle about the angle's axis.
    points = np.einsum("bij,j->bi", T[:, :3, :3], rng.normal(0, 0.02, 3)) + T[:, :3, 3]
    J = model.point_jacobian(pose, np.arange(16), points)[:, :, 6:]
    for angle in range(20):
        turned = np.cross(bodies.axes[angle], points - bodies.origins[angle])
        moves = np.any(J[:, :, angle] != 0, axis=1)
        np.testing.assert_allclose(J[moves, :, angle], turned[moves], atol=1e-12)


@given(seed=SEEDS)
def test_endpoints_and_jacobians_are_those_of_the_hand_model(seed: int) -> None:
    shape, rng = HandShape(side="left"), np.random.default_rng(seed)
    pose, model = random_pose(rng), HandModel(shape)
    bodies, ends, J = BodyPoses.at(model.chain, pose), np.empty((5, 4, 3)), np.empty((3, 26))
    compiled_kinematics.endpoints(model.chain, bodies, ends)
    np.testing.assert_allclose(ends.reshape(20, 3), model.endpoints(pose), atol=1e-14)
    points = rng.normal(0, 0.1, (16, 3))
    expected = model.point_jacobian(pose, np.arange(16), points)
    for b in range(16):
        compiled_kinematics.point_jacobian(bodies, b, points[b], J)
        np.testing.assert_allclose(J, expected[b], atol=1e-14)


@given(seed=SEEDS, length=st.floats(0.1, 10))
def test_batches_agree_with_single_poses_and_the_reference(seed: int, length: float) -> None:
    shape, rng = HandShape(scale=0.9), np.random.default_rng(seed)
    poses = np.stack([random_pose(rng) for _ in range(6)]).reshape(2, 3, 27)
    model, scaled = HandModel(shape), poses.copy()
    T = model.transforms(poses)
    np.testing.assert_array_equal(T[1, 2], model.transforms(poses[1, 2]))
    np.testing.assert_allclose(T, reference_transforms(model.chain, poses), atol=1e-14)
    scaled[..., ORIENTATION] *= length
    np.testing.assert_allclose(model.transforms(scaled), T, atol=1e-13)
    assert model.transforms(np.empty((0, 27))).shape == (0, 16, 4, 4)
