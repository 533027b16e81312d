"""The pose vector, its tangent space and its names."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.hand.pose import ANGLE_NAMES, POSE_NAMES, POSE_SIZE, make_pose, retract, tangent_between

seeds = st.integers(0, 2**32 - 1)


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
