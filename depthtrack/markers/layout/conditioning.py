"""Numerical stability of marker layouts, compiled (Schroeder et al. 2015, Sec. 4.1)."""

from typing import NamedTuple

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.markers.layout.condition import LANES, LARGEST, condition_numbers, least_conditions
from depthtrack.simd.functions import vsum
from depthtrack.simd.vectors import F64X8, loader, store
from depthtrack.types import Array, Index

_load = loader(F64X8)


class Conditioning(NamedTuple):
    """What the mean condition number reads, for F key-frames and V candidates.

    Blocks of eight key-frames are lanes; lanes beyond F repeat one of them and have the share 0.

    products: (V, B, 8 n (n + 1) / 2) lower triangle of J^T J of each candidate, rotations first, then synergies.
    sums: (V, B, 24 n) Jacobians J, row by row.
    shares: (B, 8) w1 of Eq. (7), divided by F.
    size: n.
    anchored: whether the columns of the translation are omitted (Sec. 4.1). Otherwise they are eliminated: J^T J
        becomes that of the Jacobians less their mean.
    """

    products: Array
    sums: Array
    shares: Array
    size: int
    anchored: bool

    @staticmethod
    def of(jacobians: Array, weight: float, anchored: bool) -> "Conditioning":
        """Return the tables of Jacobians (F, V, 3, n), of rotations and synergies."""
        F, V, _, n = jacobians.shape
        blocks = -(-F // LANES)
        J = np.take(jacobians, np.minimum(np.arange(blocks * LANES), F - 1), axis=0)
        low = np.tril_indices(n)
        products = np.einsum("fvcp,fvcp->vpf", J[..., low[0]], J[..., low[1]])
        sums = J.reshape(blocks * LANES, V, 3 * n).transpose(1, 2, 0)
        shares = np.where(np.arange(blocks * LANES) < F, weight / F, 0.0)

        def laned(table: Array) -> Array:
            split = table.reshape(V, -1, blocks, LANES).swapaxes(1, 2)
            return np.ascontiguousarray(split.reshape(V, blocks, -1))

        return Conditioning(laned(products), laned(sums), shares.reshape(blocks, LANES), n, anchored)


@compiled(nogil=True)
def conditions_of(layouts: Index, tables: Conditioning, bounds: Array, out: Array) -> None:
    """Write w1 E_cond, Eq. (8), of layouts (N, K) to `out` (N,).

    bounds: (N,) values from which it is infinity.
    """
    n, count = tables.size, layouts.shape[1]
    products, sums = np.empty(tables.products.shape[1:]), np.empty(tables.sums.shape[1:])
    A, d, e = np.empty(LANES * n * n), np.empty(LANES * n), np.empty(LANES * n)
    lows = np.empty(tables.shares.shape)
    for i in range(layouts.shape[0]):
        products[:], sums[:] = 0.0, 0.0
        for k in range(count - 1):
            _add(products, sums, layouts[i, k], tables)
        out[i] = _grown_condition(products, sums, layouts[i, count - 1], count, tables, bounds[i], A, d, e, lows)


@compiled(nogil=True)
def grown_conditions(base: Index, added: Index, tables: Conditioning, bounds: Array, out: Array) -> None:
    """Write w1 E_cond of a layout (K,) with each of some candidates (N,) added to `out` (N,).

    bounds: (N,) values from which it is infinity.
    """
    n, count = tables.size, base.shape[0] + 1
    products, sums = np.zeros(tables.products.shape[1:]), np.zeros(tables.sums.shape[1:])
    A, d, e = np.empty(LANES * n * n), np.empty(LANES * n), np.empty(LANES * n)
    lows = np.empty(tables.shares.shape)
    for k in range(base.shape[0]):
        _add(products, sums, base[k], tables)
    for i in range(added.shape[0]):
        out[i] = _grown_condition(products, sums, added[i], count, tables, bounds[i], A, d, e, lows)


@compiled(nogil=True)
def _add(products: Array, sums: Array, candidate: int, tables: Conditioning) -> None:
    for b in range(products.shape[0]):
        total, row = products[b], tables.products[candidate, b]
        for p in range(0, total.shape[0], LANES):
            store(total, p, _load(total, p) + _load(row, p))
        if not tables.anchored:
            first, moved = sums[b], tables.sums[candidate, b]
            for p in range(0, first.shape[0], LANES):
                store(first, p, _load(first, p) + _load(moved, p))


@compiled(nogil=True)
def _grown_condition(
    products: Array,
    sums: Array,
    candidate: int,
    count: int,
    tables: Conditioning,
    bound: float,
    A: Array,
    d: Array,
    e: Array,
    lows: Array,
) -> float:
    """Return w1 E_cond of a layout with a candidate.

    products, sums: of the layout. count: of its markers with the candidate.
    bound: value from which the result is infinity.
    A, d, e, lows: work space.

    Lower bounds of all key-frames are summed first: most layouts of a search end there.
    """
    n, B = tables.size, tables.shares.shape[0]
    if 3 * count < n + (0 if tables.anchored else 3):
        weight = tables.shares.sum()
        return weight * LARGEST if weight * LARGEST < bound else np.inf
    energy = 0.0
    for b in range(B):
        _fill_matrices(products[b], sums[b], candidate, count, b, tables, A, d)
        least_conditions(A, n, d, lows[b])
        energy += vsum(_load(tables.shares[b], 0) * _load(lows[b], 0))
        if energy >= bound:
            return np.inf
    for b in range(B):
        _fill_matrices(products[b], sums[b], candidate, count, b, tables, A, d)
        low = vsum(_load(tables.shares[b], 0) * _load(lows[b], 0))
        condition_numbers(A, n, d, e, lows[b])
        energy += vsum(_load(tables.shares[b], 0) * _load(lows[b], 0)) - low
        if energy >= bound:
            return np.inf
    return energy


@compiled(nogil=True)
def _fill_matrices(
    products: Array, sums: Array, candidate: int, count: int, b: int, tables: Conditioning, A: Array, d: Array
) -> None:
    """Write J^T J of a layout with a candidate in the key-frames of block b to A."""
    n, p, row = tables.size, 0, tables.products[candidate, b]
    for i in range(n):
        for j in range(i + 1):
            store(A, LANES * (i * n + j), _load(products, p) + _load(row, p))
            p += LANES
    if tables.anchored:
        return
    moved, share = tables.sums[candidate, b], 1.0 / count
    for c in range(3):
        for i in range(n):
            at = LANES * (c * n + i)
            store(d, LANES * i, _load(sums, at) + _load(moved, at))
        for i in range(n):
            factor = _load(d, LANES * i) * share
            for j in range(i + 1):
                at = LANES * (i * n + j)
                store(A, at, _load(A, at) - factor * _load(d, LANES * j))
