"""Interpolation of minimal acceleration against a dense oracle and the cubic polynomial."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline

from depthtrack.markers.filling.interpolation import minimal_acceleration
from depthtrack.types import Array


def dense(known: Array, count: int) -> Array:
    """Return the least-squares solution with the dense matrix of second differences."""
    D = np.zeros((count + 2, count + 4))
    for row in range(count + 2):
        D[row, row : row + 3] = 1, -2, 1
    fixed = [0, 1, count + 2, count + 3]
    free = np.arange(2, count + 2)
    return np.asarray(np.linalg.lstsq(D[:, free], -D[:, fixed] @ known, rcond=None)[0])


@given(st.integers(1, 40), st.integers(0, 1000))
def test_banded_solution_is_that_of_dense_least_squares(count: int, seed: int) -> None:
    known = np.random.default_rng(seed).normal(size=(4, 2))
    np.testing.assert_allclose(minimal_acceleration(known[:2], known[2:], count), dense(known, count), atol=1e-8)


@pytest.mark.parametrize("count", [1, 2, 3, 50])
def test_a_straight_line_is_continued(count: int) -> None:
    line = 0.3 + 0.7 * np.arange(count + 4)
    found = minimal_acceleration(line[:2], line[-2:], count)
    np.testing.assert_allclose(found, line[2:-2], atol=1e-9)


def test_small_steps_tend_to_the_cubic_hermite_polynomial() -> None:
    errors = []
    for count in (50, 100, 200):
        step = 1 / (count + 1)
        hermite = CubicHermiteSpline([0, 1], [0.2, 1.0], [2.0, -1.5])
        times = step * np.arange(1, count + 1)
        found = minimal_acceleration([0.2 - 2.0 * step, 0.2], [1.0, 1.0 - 1.5 * step], count)
        errors.append(np.abs(found - hermite(times)).max())
    assert errors[2] < 0.02
    # The error is of first order in the step.
    assert errors[1] < 0.6 * errors[0]
    assert errors[2] < 0.6 * errors[1]


def test_nothing_is_missing() -> None:
    assert minimal_acceleration(np.zeros((2, 3)), np.zeros((2, 3)), 0).shape == (0, 3)
