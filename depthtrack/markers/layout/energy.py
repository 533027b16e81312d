"""Compiled objective of marker layouts (Schroeder et al. 2015, Eq. 7 to 9)."""

import math
from typing import NamedTuple

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.markers.layout.condition import LARGEST, condition_number
from depthtrack.types import Array, Index


class Tables(NamedTuple):
    """What the objective reads, for F key-frames and V candidates.

    products: (F, V, n (n + 1) / 2) lower triangle of J^T J of each candidate, rotations first, then synergies.
    sums: (F, V, 3 n) Jacobians J, row by row.
    squares: (V, V) least squared distance over the key-frames, in squared lengths of the hand.
    hidden: (V,) share of the samples that too few cameras see.
    size: n.
    length: of the hand, metres.
    """

    products: Array
    sums: Array
    squares: Array
    hidden: Array
    size: int
    length: float
    condition_weight: float
    distance_weight: float
    occlusion_weight: float
    anchored: bool
    robust: bool


@compiled(nogil=True)
def layout_energies(layouts: Index, tables: Tables, bounds: Array, out: Array) -> None:
    """Write E (N,) of layouts (N, K) to `out`; infinity where it is at least the bound (N,)."""
    n, F = tables.size, tables.products.shape[0]
    A, d, e = np.empty((n, n)), np.empty(n), np.empty(n)
    for i in range(layouts.shape[0]):
        layout = layouts[i]
        energy = -tables.distance_weight * least_distance(layout, tables)
        energy += tables.occlusion_weight * mean_hidden(layout, tables)
        # A condition number is at least 1, so the energy of the frames to come has a lower bound.
        share = tables.condition_weight / F
        energy += tables.condition_weight
        for f in range(F):
            if energy >= bounds[i]:
                break
            lost = worst_condition(layout, f, tables, A, d, e) if tables.robust else 0.0
            energy += share * (max(lost, frame_condition(layout, f, -1, tables, A, d, e)) - 1.0)
        out[i] = energy if energy < bounds[i] else np.inf


@compiled(nogil=True)
def layout_terms(layout: Index, tables: Tables) -> tuple[float, float, float, float]:
    """Return E_cond, E_cond after the loss of the worst marker, -E_dist, and the occlusion."""
    n, F = tables.size, tables.products.shape[0]
    A, d, e = np.empty((n, n)), np.empty(n), np.empty(n)
    whole, lost = 0.0, 0.0
    for f in range(F):
        whole += frame_condition(layout, f, -1, tables, A, d, e) / F
        lost += worst_condition(layout, f, tables, A, d, e) / F
    return whole, lost, least_distance(layout, tables), mean_hidden(layout, tables)


@compiled(nogil=True)
def least_distance(layout: Index, tables: Tables) -> float:
    """Return the least distance of two markers, in lengths of the hand: -E_dist, Eq. (9).

    It is that over all key-frames.
    Eq. (6) has squared distances, which 1 / L does not make independent of the scale; their roots are.
    """
    least = np.inf
    for a in range(layout.shape[0]):
        for b in range(a):
            least = min(least, tables.squares[layout[a], layout[b]])
    return math.sqrt(least) if layout.shape[0] > 1 else 0.0


@compiled(nogil=True)
def mean_hidden(layout: Index, tables: Tables) -> float:
    """Return the mean over the markers of the share of samples that too few cameras see."""
    total = 0.0
    for k in range(layout.shape[0]):
        total += tables.hidden[layout[k]]
    return total / layout.shape[0]


@compiled(nogil=True)
def worst_condition(layout: Index, f: int, tables: Tables, A: Array, d: Array, e: Array) -> float:
    """Return the largest condition number in a key-frame after the loss of one marker."""
    worst = 0.0
    for k in range(layout.shape[0]):
        worst = max(worst, frame_condition(layout, f, k, tables, A, d, e))
    return worst


@compiled(nogil=True)
def frame_condition(layout: Index, f: int, without: int, tables: Tables, A: Array, d: Array, e: Array) -> float:
    """Return kappa(J^T J) of a layout in key-frame f, Eq. (5).

    without: marker that is lost, -1 for none.
    A, d, e: work space.

    With an anchor, the columns of the translation are omitted (Sec. 4.1). Without, they are eliminated: J^T J becomes
    that of the Jacobians less their mean.
    """
    n, count = tables.size, 0
    A[:] = 0.0
    for k in range(layout.shape[0]):
        if k == without:
            continue
        count += 1
        row, p = tables.products[f, layout[k]], 0
        for i in range(n):
            for j in range(i + 1):
                A[i, j] += row[p]
                p += 1
    if 3 * count < n + (0 if tables.anchored else 3):
        return LARGEST
    if not tables.anchored:
        for c in range(3):
            d[:] = 0.0
            for k in range(layout.shape[0]):
                if k != without:
                    for i in range(n):
                        d[i] += tables.sums[f, layout[k], c * n + i]
            for i in range(n):
                for j in range(i + 1):
                    A[i, j] -= d[i] * d[j] / count
    return condition_number(A, d, e)
