"""Numerical stability of marker layouts, compiled (Schroeder et al. 2015, Sec. 4.1)."""

from typing import NamedTuple

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.markers.layout.condition import LARGEST, condition_number, least_condition
from depthtrack.types import Array, Index


class Conditioning(NamedTuple):
    """What the mean condition number reads, for F key-frames and V candidates.

    products: (F, V, n (n + 1) / 2) lower triangle of J^T J of each candidate, rotations first, then synergies.
    sums: (F, V, 3 n) Jacobians J, row by row.
    size: n.
    weight: w1 of Eq. (7).
    anchored: whether the columns of the translation are omitted (Sec. 4.1). Otherwise they are eliminated: J^T J
        becomes that of the Jacobians less their mean.
    """

    products: Array
    sums: Array
    size: int
    weight: float
    anchored: bool


class Summed(NamedTuple):
    """Sums over the markers of a layout, in each key-frame.

    products: (F, n (n + 1) / 2). sums: (F, 3 n), empty with an anchor.
    """

    products: Array
    sums: Array


@compiled(nogil=True)
def conditions_of(layouts: Index, tables: Conditioning, bounds: Array, out: Array) -> None:
    """Write w1 E_cond, Eq. (8), of layouts (N, K) to `out` (N,).

    bounds: (N,) values from which it is infinity.
    """
    whole, none = sum_of(np.empty(0, np.int64), tables), sum_of(np.empty(0, np.int64), tables)
    work, lows = np.empty((tables.size + 2, tables.size)), np.empty(tables.products.shape[0])
    for i in range(layouts.shape[0]):
        layout = layouts[i]
        whole.products[:], whole.sums[:] = none.products, none.sums
        for k in range(layout.shape[0] - 1):
            _add(whole, layout[k], tables)
        last = layout[layout.shape[0] - 1]
        out[i] = _grown_condition(whole, last, layout.shape[0], tables, bounds[i], work, lows)


@compiled(nogil=True)
def grown_conditions(base: Index, added: Index, tables: Conditioning, bounds: Array, out: Array) -> None:
    """Write w1 E_cond of a layout (K,) with each of some candidates (N,) added to `out` (N,).

    bounds: (N,) values from which it is infinity.
    """
    whole = sum_of(base, tables)
    work, lows = np.empty((tables.size + 2, tables.size)), np.empty(tables.products.shape[0])
    for i in range(added.shape[0]):
        out[i] = _grown_condition(whole, added[i], base.shape[0] + 1, tables, bounds[i], work, lows)


@compiled(nogil=True)
def sum_of(layout: Index, tables: Conditioning) -> Summed:
    """Return the sums over the markers of a layout (K,)."""
    F = tables.products.shape[0]
    columns = 0 if tables.anchored else tables.sums.shape[2]
    whole = Summed(np.zeros((F, tables.products.shape[2])), np.zeros((F, columns)))
    for k in range(layout.shape[0]):
        _add(whole, layout[k], tables)
    return whole


@compiled(nogil=True)
def _add(whole: Summed, candidate: int, tables: Conditioning) -> None:
    for f in range(whole.products.shape[0]):
        row, total = tables.products[f, candidate], whole.products[f]
        for p in range(total.shape[0]):
            total[p] += row[p]
        moved, first = tables.sums[f, candidate], whole.sums[f]
        for p in range(first.shape[0]):
            first[p] += moved[p]


@compiled(nogil=True)
def _grown_condition(
    whole: Summed, candidate: int, count: int, tables: Conditioning, bound: float, work: Array, lows: Array
) -> float:
    """Return w1 E_cond of the layout `whole` with a candidate.

    bound: value from which it is infinity.
    count: of the markers with the candidate.
    work: (n + 2, n). lows: (F,) receives lower bounds of the condition numbers.

    The bounds of all key-frames are summed first: most layouts of a search end there.
    """
    n, F = tables.size, whole.products.shape[0]
    A, d, e = work[:n], work[n], work[n + 1]
    share = tables.weight / F
    if 3 * count < n + (0 if tables.anchored else 3):
        return tables.weight * LARGEST if tables.weight * LARGEST < bound else np.inf
    energy = tables.weight
    for f in range(F):
        _fill(whole, candidate, count, f, tables, A, d)
        lows[f] = least_condition(A)
        energy += share * (lows[f] - 1.0)
        if energy >= bound:
            return np.inf
    for f in range(F):
        _fill(whole, candidate, count, f, tables, A, d)
        energy += share * (condition_number(A, d, e) - lows[f])
        if energy >= bound:
            return np.inf
    return energy


@compiled(nogil=True)
def _fill(whole: Summed, candidate: int, count: int, f: int, tables: Conditioning, A: Array, d: Array) -> None:
    """Write J^T J of the layout with a candidate in key-frame f to A (n, n).

    Its lower triangle is written.
    """
    n, p = tables.size, 0
    total, row = whole.products[f], tables.products[f, candidate]
    for i in range(n):
        for j in range(i + 1):
            A[i, j] = total[p] + row[p]
            p += 1
    if not tables.anchored:
        first, moved = whole.sums[f], tables.sums[f, candidate]
        for c in range(3):
            for i in range(n):
                d[i] = first[c * n + i] + moved[c * n + i]
            for i in range(n):
                for j in range(i + 1):
                    A[i, j] -= d[i] * d[j] / count
