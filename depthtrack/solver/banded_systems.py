"""Symmetric positive definite banded systems, compiled.

A matrix A (n, n) with `width` - 1 bands below its diagonal is stored as rows (n, width): rows[j, d] is A[j + d, j].
Elements beyond the last row of A are ignored. The order of additions is fixed, whatever the machine's BLAS is.
"""

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.types import Array


@compiled(nogil=True)
def banded_cholesky(rows: Array) -> bool:
    """Replace A by its Cholesky factor L in place. Returns False if A is not positive definite."""
    n, width = rows.shape
    for j in range(n):
        row, count = rows[j], min(width, n - j)
        if not row[0] > 0.0:
            return False
        row[0] = np.sqrt(row[0])
        for d in range(1, count):
            row[d] /= row[0]
        for d in range(1, count):
            factor, other = row[d], rows[j + d]
            if factor != 0.0:
                for e in range(d, count):
                    other[e - d] -= factor * row[e]
    return True


@compiled(nogil=True)
def solve_lower(factor: Array, b: Array) -> None:
    """Solve L x = b in place, b (n, m)."""
    n, width = factor.shape
    for j in range(n):
        for k in range(b.shape[1]):
            b[j, k] /= factor[j, 0]
        for d in range(1, min(width, n - j)):
            f = factor[j, d]
            for k in range(b.shape[1]):
                b[j + d, k] -= f * b[j, k]


@compiled(nogil=True)
def solve_upper(factor: Array, b: Array) -> None:
    """Solve L^T x = b in place, b (n, m)."""
    n, width = factor.shape
    for j in range(n - 1, -1, -1):
        for d in range(1, min(width, n - j)):
            f = factor[j, d]
            for k in range(b.shape[1]):
                b[j, k] -= f * b[j + d, k]
        for k in range(b.shape[1]):
            b[j, k] /= factor[j, 0]
