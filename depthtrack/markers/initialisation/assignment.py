"""Optimal assignment: the Hungarian method with padding (Maycock et al. 2015, Eq. 3)."""

import numpy as np
from scipy.optimize import linear_sum_assignment

from depthtrack.types import Array, Index

PADDING = 1e6
"""Cost of an assignment to a point that does not exist, "extremely large" beside any distance."""


def assign_all(cost: Array) -> Index:
    """Return the point (M,) of each marker, -1 for those left over: Eq. (3).

    cost: (M, K) below `PADDING`. The matrix is padded to a square one.
    """
    markers, points = cost.shape
    square = np.full((max(cost.shape), max(cost.shape)), PADDING)
    square[:markers, :points] = cost
    _, chosen = linear_sum_assignment(square)
    return np.where(chosen[:markers] < points, chosen[:markers], -1).astype(np.int64)


def assign_within(cost: Array, missing: float) -> Index:
    """Return the point (M,) of each marker, -1 for none, with the least sum of costs.

    cost: (M, K).
    missing: cost of a marker without a point.
    """
    markers, points = cost.shape
    padded = np.full((markers, points + markers), missing)
    padded[:, :points] = np.minimum(cost, PADDING)
    _, chosen = linear_sum_assignment(padded)
    return np.where(chosen < points, chosen, -1).astype(np.int64)
