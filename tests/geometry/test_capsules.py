"""The distance to a tapered capsule agrees with that to many balls along its axis."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.geometry.capsules import capsule_distance, compiled_nearest_ball, nearest_ball


@given(seed=st.integers(0, 2**32 - 1), taper=st.floats(-0.9, 0.9))
def test_the_distance_is_that_to_the_nearest_of_many_balls(seed: int, taper: float) -> None:
    rng = np.random.default_rng(seed)
    length, radius = 0.04, 0.045
    along, across = rng.uniform(-0.05, 0.1, 40), rng.uniform(0, 0.1, 40)
    t = np.linspace(0, length, 4001)
    balls = np.hypot(along[:, None] - t, across[:, None]) - (radius - taper * t)
    np.testing.assert_allclose(capsule_distance(along, across, radius, taper, length), balls.min(axis=1), atol=1e-5)


@given(seed=st.integers(0, 2**32 - 1), taper=st.floats(-0.95, 0.95))
def test_the_compiled_form_is_the_same(seed: int, taper: float) -> None:
    rng = np.random.default_rng(seed)
    along, across = rng.uniform(-0.05, 0.1, 10), rng.uniform(0, 0.1, 10)
    expected = nearest_ball(along, across, taper, 0.04)
    found = [compiled_nearest_ball(*each, taper, 0.04) for each in zip(along, across, strict=True)]
    np.testing.assert_array_equal(found, expected)
