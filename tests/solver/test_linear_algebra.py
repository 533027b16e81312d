"""Tests of the compiled linear algebra of small systems."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.solver.linear_algebra import cholesky_solve, hold_parameter

SEEDS = st.integers(0, 2**32 - 1)


@given(seed=SEEDS, size=st.integers(1, 26))
def test_cholesky_agrees_with_numpy(seed: int, size: int) -> None:
    rng = np.random.default_rng(seed)
    factor, b = rng.normal(size=(size + 2, size)), rng.normal(size=size)
    A = factor.T @ factor
    expected, x = np.linalg.solve(A, b), b.copy()
    assert cholesky_solve(A.copy(), x)
    np.testing.assert_allclose(A @ x, b, atol=1e-9 * max(1, float(np.abs(expected).max())) * np.abs(A).max())
    assert not cholesky_solve(A - (np.linalg.eigvalsh(A)[0] + 0.1) * np.eye(size), b.copy())


@given(seed=SEEDS, size=st.integers(2, 12))
def test_a_held_parameter_leaves_the_system_of_the_others(seed: int, size: int) -> None:
    rng = np.random.default_rng(seed)
    factor, b = rng.normal(size=(size + 2, size)), rng.normal(size=size)
    A, held = factor.T @ factor, int(rng.integers(size))
    others = np.delete(np.arange(size), held)
    expected = np.linalg.solve(A[np.ix_(others, others)], b[others])
    hold_parameter(A, b, held)
    x = np.linalg.solve(A, b)
    assert x[held] == 0
    np.testing.assert_allclose(x[others], expected, rtol=1e-9)
