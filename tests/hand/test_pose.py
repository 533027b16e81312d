"""The pose vector, its tangent space and its names."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.geometry.rotations import quaternion_exp, quaternion_log, quaternion_product
from depthtrack.hand.pose import (
    ANGLE_NAMES,
    ANGLES,
    ORIENTATION,
    POSE_NAMES,
    POSE_SIZE,
    POSITION,
    make_pose,
    retract,
    tangent_between,
)
from tests.support.hands import random_pose

seeds = st.integers(0, 2**32 - 1)


@given(seed=seeds)
def test_tangent_between_leads_from_one_pose_to_the_other(seed: int) -> None:
    rng = np.random.default_rng(seed)
    start, end = (make_pose(rng.normal(size=(3, 3)), rng.normal(size=(3, 4)), rng.normal(size=(3, 20))) for _ in "ab")
    reached = retract(start, tangent_between(start, end))
    np.testing.assert_allclose(reached, end, atol=1e-9)


@given(seed=seeds, size=st.sampled_from([0.0, 1e-12, 1e-3, 1.0, 4.0]), count=st.sampled_from([(), (1,), (2, 3)]))
def test_retraction_and_its_inverse_equal_the_quaternions_in_numpy(
    seed: int, size: float, count: tuple[int, ...]
) -> None:
    rng = np.random.default_rng(seed)
    pose, step = random_pose(rng), size * rng.normal(size=(*count, 26))
    quaternion = quaternion_product(quaternion_exp(step[..., 3:6]), pose[ORIENTATION])
    expected = make_pose(pose[POSITION] + step[..., :3], quaternion, pose[ANGLES] + step[..., 6:])
    reached = retract(pose, step)
    np.testing.assert_allclose(reached, expected, atol=1e-12)
    assert np.all(reached[..., 3] >= 0)
    assert np.linalg.norm(reached[..., ORIENTATION], axis=-1) == pytest.approx(1)
    turn = quaternion_log(quaternion_product(expected[..., ORIENTATION], pose[ORIENTATION] * [1, -1, -1, -1]))
    back = tangent_between(pose, reached)
    np.testing.assert_allclose(back[..., 3:6], turn, atol=1e-9)
    np.testing.assert_allclose(back[..., 6:], step[..., 6:], atol=1e-12)


def test_no_poses_give_none() -> None:
    assert retract(np.zeros(27), np.empty((0, 26))).shape == (0, 27)
    assert tangent_between(np.empty((0, 27)), np.empty((0, 27))).shape == (0, 26)


def test_names_cover_the_vector() -> None:
    assert len(POSE_NAMES) == POSE_SIZE
    assert len(set(ANGLE_NAMES)) == 20
    assert ANGLE_NAMES[4] == "index_mcp_abduction"
