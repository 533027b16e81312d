"""Banded systems against dense ones."""

import numpy as np
import pytest

from depthtrack.solver.banded_systems import banded_cholesky, solve_lower, solve_upper
from depthtrack.types import Array


def system(n: int, width: int) -> tuple[Array, Array]:
    """Return a positive definite matrix (n, n) and its rows (n, width)."""
    generator = np.random.default_rng(n)
    L = np.tril(generator.normal(size=(n, n)))
    L[np.subtract.outer(np.arange(n), np.arange(n)) >= width] = 0.0
    A = L @ L.T + np.eye(n)
    rows = np.zeros((n, width))
    for j in range(n):
        column = A[j : j + width, j]
        rows[j, : len(column)] = column
    return A, rows


@pytest.mark.parametrize(("n", "width"), [(1, 3), (4, 1), (7, 3), (5, 9), (60, 12)])
def test_solution_is_that_of_the_dense_system(n: int, width: int) -> None:
    A, rows = system(n, width)
    b = np.random.default_rng(1).normal(size=(n, 2))
    x = b.copy()
    assert banded_cholesky(rows)
    solve_lower(rows, x)
    solve_upper(rows, x)
    np.testing.assert_allclose(A @ x, b, atol=1e-9)


def test_upper_solve_of_noise_has_the_covariance_of_the_inverse() -> None:
    A, rows = system(6, 3)
    banded_cholesky(rows)
    columns = np.eye(6)
    solve_upper(rows, columns)
    np.testing.assert_allclose(columns @ columns.T, np.linalg.inv(A), atol=1e-10)


def test_an_indefinite_matrix_is_refused() -> None:
    assert not banded_cholesky(np.array([[1.0, 2.0], [1.0, 0.0]]))
