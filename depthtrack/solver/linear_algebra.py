"""Small dense systems of normal equations, compiled."""

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.types import Array


@compiled(nogil=True)
def hold_parameter(A: Array, b: Array, i: int) -> None:
    """Remove parameter i from the system A x = b in place.

    Its step becomes zero, and the steps of the others do not depend on it.

    A: (n, n).
    b: (n,).
    """
    for j in range(b.shape[0]):
        A[i, j] = A[j, i] = 0.0
    A[i, i] = 1.0
    b[i] = 0.0


@compiled(nogil=True)
def cholesky(A: Array) -> bool:
    """Replace the lower triangle of A (n, n) by L with A = L L^T; only that triangle is read.

    Returns False if A is not positive definite.
    """
    n = A.shape[0]
    for j in range(n):
        d = A[j, j]
        for k in range(j):
            d -= A[j, k] * A[j, k]
        if not d > 1e-14:
            return False
        d = np.sqrt(d)
        A[j, j] = d
        for i in range(j + 1, n):
            s = A[i, j]
            for k in range(j):
                s -= A[i, k] * A[j, k]
            A[i, j] = s / d
    return True


@compiled(nogil=True)
def cholesky_solve(A: Array, b: Array) -> bool:
    """Solve A x = b in place: A (n, n) is overwritten and b (n,) becomes x.

    Returns False if A is not symmetric positive definite.
    """
    n = b.shape[0]
    if not cholesky(A):
        return False
    for i in range(n):
        s = b[i]
        for k in range(i):
            s -= A[i, k] * b[k]
        b[i] = s / A[i, i]
    for i in range(n - 1, -1, -1):
        s = b[i]
        for k in range(i + 1, n):
            s -= A[k, i] * b[k]
        b[i] = s / A[i, i]
    return True
