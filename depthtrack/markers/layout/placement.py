"""Distances and occlusion of markers, compiled (Schroeder et al. 2015, Sec. 4.2)."""

import math
from typing import NamedTuple

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.types import Array, Index


class Placement(NamedTuple):
    """Terms of V candidates that depend on their places alone.

    squares: (V, V) least squared distance over the key-frames, in squared lengths of the hand.
    hidden: (V,) share of the samples that too few cameras see.
    length: of the hand, metres.
    enough: distance that two markers should have, in lengths of the hand; 0: the farther, the better.
    """

    squares: Array
    hidden: Array
    length: float
    distance_weight: float
    enough: float
    occlusion_weight: float


@compiled(nogil=True)
def placement_energies(layouts: Index, placement: Placement, out: Array) -> None:
    """Write the energy of distances and occlusion of layouts (N, K) to `out` (N,)."""
    for i in range(layouts.shape[0]):
        lack = placement.enough - least_distance(layouts[i], placement)
        out[i] = placement.distance_weight * (lack if placement.enough == 0.0 else max(lack, 0.0))
        out[i] += placement.occlusion_weight * mean_hidden(layouts[i], placement)


@compiled(nogil=True)
def least_distance(layout: Index, placement: Placement) -> float:
    """Return the least distance of two markers, in lengths of the hand: -E_dist, Eq. (9).

    It is that over all key-frames.
    Eq. (6) has squared distances, which 1 / L does not make independent of the scale; their roots are.
    """
    least = np.inf
    for a in range(layout.shape[0]):
        for b in range(a):
            least = min(least, placement.squares[layout[a], layout[b]])
    return math.sqrt(least) if layout.shape[0] > 1 else 0.0


@compiled(nogil=True)
def mean_hidden(layout: Index, placement: Placement) -> float:
    """Return the mean over the markers of the share of samples that too few cameras see."""
    total = 0.0
    for k in range(layout.shape[0]):
        total += placement.hidden[layout[k]]
    return total / layout.shape[0]
