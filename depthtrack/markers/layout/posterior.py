"""Expected error of the poses that markers give, compiled: a Bayesian A-optimal design.

Markers with normally distributed errors leave the posterior covariance S = (P + sum of J^T J / s^2)^-1 of the pose,
for a normal prior of precision P. The expected squared error of the hand is tr(W S) (Chaloner and Verdinelli, "Bayesian
experimental design: a review", Statistical Science 10(3), 1995). One more marker changes S by a matrix of rank three
(Woodbury), so that it is cheap to compare all candidates.
"""

from typing import NamedTuple

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.types import Array, Index

COLUMNS = 10
"""Columns of a candidate's Jacobian: the global pose, and the angles of its finger."""


class Posterior(NamedTuple):
    """What the expected error reads, for F key-frames and V candidates.

    jacobians: (F, V, 3, 10) of each candidate; zero for the angles if it is on the palm.
    fingers: (V,) finger of each, 0 if it is on the palm.
    precision: (V,) inverse variance of a coordinate, 1/m^2.
    prior: (F, 26, 26) precision P of the pose, with that of a marker at the wrist.
    spread: (F, 26, 26) W, mean of J^T J over the points of the hand, mm^2.
    """

    jacobians: Array
    fingers: Index
    precision: Array
    prior: Array
    spread: Array


@compiled(nogil=True)
def errors_of(layouts: Index, tables: Posterior, bounds: Array, out: Array) -> None:
    """Write the root mean square error, mm, of layouts (N, K) to `out` (N,).

    bounds: (N,) values from which it is infinity.

    The mean is over key-frames and points of the hand.
    """
    F = tables.prior.shape[0]
    S, work = np.empty((26, 26)), np.empty((26, 26))
    for i in range(layouts.shape[0]):
        total, limit = 0.0, F * bounds[i] * bounds[i] if bounds[i] > 0 else 0.0
        for f in range(F):
            _covariance(layouts[i], f, tables, S, work)
            for a in range(26):
                for b in range(26):
                    total += tables.spread[f, a, b] * S[a, b]
            if total >= limit:
                break
        out[i] = np.sqrt(total / F) if total < limit else np.inf


@compiled(nogil=True)
def grown_errors(base: Index, frames: Index, tables: Posterior, out: Array) -> None:
    """Write the mean square error, mm^2, of a layout (K,) with each candidate to `out` (F, V).

    frames: rows that are written.
    """
    S, C, work = np.empty((26, 26)), np.empty((26, 26)), np.empty((26, 26))
    sub_S, sub_C = np.empty((5, COLUMNS, COLUMNS)), np.empty((5, COLUMNS, COLUMNS))
    M, N, row_S, row_C = np.empty((3, 3)), np.empty((3, 3)), np.empty(COLUMNS), np.empty(COLUMNS)
    for f in frames:
        _covariance(base, f, tables, S, work)
        W, error = tables.spread[f], 0.0
        _multiply(W, S, work)
        for a in range(26):
            error += work[a, a]
        _multiply(S, work, C)
        for finger in range(5):
            for a in range(COLUMNS):
                for b in range(COLUMNS):
                    sub_S[finger, a, b] = S[_column(finger, a), _column(finger, b)]
                    sub_C[finger, a, b] = C[_column(finger, a), _column(finger, b)]
        for v in range(tables.fingers.shape[0]):
            J, finger = tables.jacobians[f, v], tables.fingers[v]
            for c in range(3):
                row_S[:], row_C[:] = 0.0, 0.0
                for a in range(COLUMNS):
                    for b in range(COLUMNS):
                        row_S[b] += J[c, a] * sub_S[finger, a, b]
                        row_C[b] += J[c, a] * sub_C[finger, a, b]
                for e in range(c, 3):
                    M[c, e], N[c, e] = 0.0, 0.0
                    for b in range(COLUMNS):
                        M[c, e] += row_S[b] * J[e, b]
                        N[c, e] += row_C[b] * J[e, b]
                M[c, c] += 1.0 / tables.precision[v]
            out[f, v] = error - _trace_of_quotient(M, N)


@compiled(nogil=True)
def _multiply(A: Array, B: Array, out: Array) -> None:
    out[:] = 0.0
    for i in range(26):
        for k in range(26):
            factor = A[i, k]
            for j in range(26):
                out[i, j] += factor * B[k, j]


@compiled(nogil=True)
def _column(finger: int, k: int) -> int:
    """Return the column among 26 of a candidate's column k."""
    return k if k < 6 else 4 * finger + k


@compiled(nogil=True)
def _trace_of_quotient(M: Array, N: Array) -> float:
    """Return tr(M^-1 N) of symmetric (3, 3) matrices; their upper triangles are read."""
    a, b, c, d, e, f = M[0, 0], M[0, 1], M[0, 2], M[1, 1], M[1, 2], M[2, 2]
    A, B, C = d * f - e * e, c * e - b * f, b * e - c * d
    D, E, F = a * f - c * c, b * c - a * e, a * d - b * b
    return (A * N[0, 0] + D * N[1, 1] + F * N[2, 2] + 2 * (B * N[0, 1] + C * N[0, 2] + E * N[1, 2])) / (
        a * A + b * B + c * C
    )


@compiled(nogil=True)
def _covariance(layout: Index, f: int, tables: Posterior, S: Array, L: Array) -> None:
    """Write the posterior covariance of a layout (K,) in key-frame f to S (26, 26).

    L: (26, 26) work space, receives the inverse of the triangular factor.
    """
    S[:] = tables.prior[f]
    for k in range(layout.shape[0]):
        J, finger, precision = tables.jacobians[f, layout[k]], tables.fingers[layout[k]], tables.precision[layout[k]]
        for a in range(COLUMNS):
            i = _column(finger, a)
            for b in range(a + 1):
                product = J[0, a] * J[0, b] + J[1, a] * J[1, b] + J[2, a] * J[2, b]
                S[i, _column(finger, b)] += precision * product
    # Cholesky's factor in the lower triangle of S, then its inverse in L.
    for j in range(26):
        for k in range(j):
            factor = S[j, k]
            for i in range(j, 26):
                S[i, j] -= S[i, k] * factor
        inverse = 1.0 / np.sqrt(S[j, j])
        for i in range(j, 26):
            S[i, j] *= inverse
    L[:] = 0.0
    for i in range(26):
        inverse = 1.0 / S[i, i]
        for k in range(i):
            factor = S[i, k]
            for j in range(k + 1):
                L[i, j] -= factor * L[k, j]
        for j in range(i):
            L[i, j] *= inverse
        L[i, i] = inverse
    S[:] = 0.0
    for k in range(26):
        for i in range(k + 1):
            factor = L[k, i]
            for j in range(i + 1):
                S[i, j] += factor * L[k, j]
    for i in range(26):
        for j in range(i):
            S[j, i] = S[i, j]
