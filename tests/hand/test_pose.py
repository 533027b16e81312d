"""The pose vector's tangent space and rotations, against scipy."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from depthtrack.hand.pose import (
    ANGLE_NAMES,
    POSE_NAMES,
    POSE_SIZE,
    make_pose,
    quaternion_exp,
    quaternion_from_matrix,
    quaternion_log,
    quaternion_product,
    retract,
    rotation_matrix,
    tangent_between,
)

seeds = st.integers(0, 2**32 - 1)


def scipy_rotation(q: np.ndarray) -> Rotation:
    return Rotation.from_quat(q[..., [1, 2, 3, 0]])


@given(seed=seeds)
def test_rotations_agree_with_scipy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = rng.normal(size=(2, 5, 4))
    np.testing.assert_allclose(rotation_matrix(a), scipy_rotation(a).as_matrix(), atol=1e-12)
    product = (scipy_rotation(a) * scipy_rotation(b)).as_matrix()
    np.testing.assert_allclose(rotation_matrix(quaternion_product(a, b)), product, atol=1e-12)
    np.testing.assert_allclose(rotation_matrix(quaternion_from_matrix(product)), product, atol=1e-12)
    vectors = rng.normal(size=(5, 3))
    np.testing.assert_allclose(
        rotation_matrix(quaternion_exp(vectors)), Rotation.from_rotvec(vectors).as_matrix(), atol=1e-12
    )


@given(seed=seeds, size=st.floats(0, 3.1))
def test_log_undoes_exp(seed: int, size: float) -> None:
    direction = np.random.default_rng(seed).normal(size=3)
    vector = size * direction / np.linalg.norm(direction)
    np.testing.assert_allclose(quaternion_log(quaternion_exp(vector)), vector, atol=1e-9)


@given(seed=seeds)
def test_tangent_between_leads_from_one_pose_to_the_other(seed: int) -> None:
    rng = np.random.default_rng(seed)
    start, end = (make_pose(rng.normal(size=(3, 3)), rng.normal(size=(3, 4)), rng.normal(size=(3, 20))) for _ in "ab")
    reached = retract(start, tangent_between(start, end))
    np.testing.assert_allclose(reached, end, atol=1e-9)


def test_names_cover_the_vector() -> None:
    assert len(POSE_NAMES) == POSE_SIZE
    assert len(set(ANGLE_NAMES)) == 20
    assert ANGLE_NAMES[4] == "index_mcp_abduction"
