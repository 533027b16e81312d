"""Interpolation of minimal acceleration with C1 constraints (Maycock et al. 2015, III-C)."""

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solveh_banded

from depthtrack.types import Array

_STENCIL = np.array([1.0, -2.0, 1.0])
"""Second difference."""


def minimal_acceleration(before: ArrayLike, after: ArrayLike, count: int) -> Array:
    """Return the values (n, ...) between two pairs of values with minimal acceleration.

    before: (2, ...) values at times t - 1 and t; the pair states theta and its derivative at t.
    after: (2, ...) values at times t + n + 1 and t + n + 2.
    count: n, number of missing values.

    The squared second differences, which are the squared acceleration in uniform steps, have the least sum. That is
    one symmetric n x n system with two bands beside the diagonal. As the steps become small, the values tend to the
    cubic Hermite polynomial of the constraints.
    """
    if count == 0:
        return np.empty((0, *np.shape(before)[1:]))
    known = np.concatenate([np.asarray(before, dtype=np.float64), np.asarray(after, dtype=np.float64)])
    values = known.reshape(4, -1)
    autocorrelation = np.correlate(_STENCIL, _STENCIL, "full")[2:]
    bands = np.repeat(autocorrelation[: min(3, count), None], count, axis=1)
    right = np.zeros((count, values.shape[1]))
    for row, column, factor in ((0, 0, 2), (0, 1, 1), (1, 1, 2), (-1, 3, 2), (-1, 2, 1), (-2, 2, 2)):
        if -count <= row < count:
            right[row] -= autocorrelation[factor] * values[column]
    return np.asarray(solveh_banded(bands, right, lower=True)).reshape(count, *known.shape[1:])
