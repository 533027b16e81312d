"""Condition number of a symmetric matrix of a few rows (Schroeder et al. 2015, Eq. 5).

Householder tridiagonalisation, then Laguerre's iteration for both extreme eigenvalues. From beyond all eigenvalues of a
symmetric matrix it converges to the nearest one, monotonically and cubically (Wilkinson, The Algebraic Eigenvalue
Problem, 1965, Ch. 7).
"""

import math

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.types import Array

LARGEST = 1e12
"""Condition number of a singular matrix."""
_STEP = 1e-6
"""Relative step after which the next would be below rounding."""
_ITERATIONS = 60


@compiled(nogil=True)
def condition_number(A: Array, d: Array, e: Array) -> float:
    """Return the ratio of the largest to the smallest eigenvalue, at most `LARGEST`.

    A: (n, n) symmetric, positive semidefinite; its lower triangle is read and overwritten.
    d, e: (n,) work space.
    """
    n = A.shape[0]
    _tridiagonalise(A, d, e)
    total = 0.0
    for i in range(n):
        total += d[i]
        e[i] *= e[i]
    low, high = _nearest_eigenvalue(d, e, 0.0, -1.0), _nearest_eigenvalue(d, e, total, 1.0)
    return LARGEST if not low * LARGEST > high else high / low


@compiled(nogil=True)
def _tridiagonalise(A: Array, d: Array, e: Array) -> None:
    """Write the diagonal to d and the subdiagonal to e[1:]."""
    n = A.shape[0]
    for i in range(n - 1, 0, -1):
        square = 0.0
        for k in range(i):
            square += A[i, k] * A[i, k]
        f = A[i, i - 1]
        rest = square - f * f
        if i == 1 or rest <= 0.0:
            e[i], d[i] = f, A[i, i]
            continue
        g = -math.copysign(math.sqrt(square), f)
        e[i], d[i] = g, A[i, i]
        # The Householder vector is row i with f - g in place of f; h is half its square.
        h = square - f * g
        A[i, i - 1] = f - g
        dot = 0.0
        for j in range(i):
            total = 0.0
            for k in range(j + 1):
                total += A[j, k] * A[i, k]
            for k in range(j + 1, i):
                total += A[k, j] * A[i, k]
            d[j] = total / h
            dot += d[j] * A[i, j]
        half = dot / (h + h)
        for j in range(i):
            d[j] -= half * A[i, j]
        for j in range(i):
            for k in range(j + 1):
                A[j, k] -= A[i, j] * d[k] + d[j] * A[i, k]
    d[0], e[0] = A[0, 0], 0.0


@compiled(nogil=True)
def _nearest_eigenvalue(d: Array, squares: Array, start: float, side: float) -> float:
    """Return the eigenvalue nearest to `start` of a tridiagonal matrix.

    d: (n,) diagonal; squares: (n,) squared subdiagonal in [1:].
    side: -1 if `start` is below all eigenvalues, 1 if above.
    """
    n, x = d.shape[0], start
    for _ in range(_ITERATIONS):
        # The pivots of T - x, and the first two derivatives of the logarithm of its determinant.
        pivot = d[0] - x
        if pivot * side >= 0.0:
            return x
        slope, curve = -1.0 / pivot, 0.0
        first, second = slope, slope * slope
        for i in range(1, n):
            t = squares[i] / pivot
            pivot = d[i] - x - t
            if pivot * side >= 0.0:
                return x
            inverse = 1.0 / pivot
            curve = t * (curve - 2.0 * slope * slope) * inverse
            slope = (t * slope - 1.0) * inverse
            first += slope
            second += slope * slope - curve
        root = math.sqrt(max((n - 1) * (n * second - first * first), 0.0))
        step = n / (first + side * root)
        x -= step
        if abs(step) <= _STEP * abs(x):
            break
    return x


@compiled(nogil=True)
def least_condition(A: Array) -> float:
    """Return a lower bound of `condition_number`, at a fraction of its time.

    A: (n, n) symmetric, positive semidefinite; its lower triangle is read and overwritten.

    The largest eigenvalue is at least each element of the diagonal. The smallest is at most each pivot of Cholesky's
    factorisation, since a pivot is on the diagonal of a Schur complement.
    """
    n, high, low = A.shape[0], 0.0, np.inf
    for i in range(n):
        high = max(high, A[i, i])
    for j in range(n):
        pivot = A[j, j]
        low = min(low, pivot)
        if not low * LARGEST > high:
            return LARGEST
        inverse = 1.0 / pivot
        for i in range(j + 1, n):
            factor = A[i, j] * inverse
            for k in range(j + 1, i + 1):
                A[i, k] -= factor * A[k, j]
    return high / low
