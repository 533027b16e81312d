"""Elimination of poses from normal equations with shared parameters, such as hand sizes.

Each view has a pose of its own, and all views share the other parameters. The Schur complement removes the pose of a
view; what is left is what the view contributes to the shared parameters.
"""

from dataclasses import dataclass

import numpy as np

from depthtrack.hand.limits import LOWER, UPPER
from depthtrack.hand.pose import TANGENT_SIZE
from depthtrack.solver.linear_algebra import hold_parameter
from depthtrack.types import Array, Mask


@dataclass(frozen=True)
class EliminatedPose:
    """Normal equations of m shared parameters after elimination of the pose of one view.

    step: (26,) of the pose if the shared parameters stay.
    step_by_shared: (26, m) its change with them.
    information: (m, m).
    gradient: (m,).
    """

    step: Array
    step_by_shared: Array
    information: Array
    gradient: Array


def eliminate_pose(H: Array, g: Array, angles: Array, damping: Array) -> EliminatedPose:
    """Eliminate the pose from the normal equations of one view.

    An angle is held if its step would exceed a limit.

    H: (26 + m, 26 + m) J^T J, the pose first.
    g: (26 + m,) J^T e.
    angles: (20,) rad, within the limits.
    damping: (26,) added to the diagonal.
    """
    n = TANGENT_SIZE
    A, b, C = H[:n, :n] + np.diag(damping), g[:n].copy(), H[:n, n:].copy()
    pushed = ((angles <= LOWER) & (b[6:] > 0)) | ((angles >= UPPER) & (b[6:] < 0))
    for i in 6 + np.flatnonzero(pushed):
        hold_parameter(A, b, int(i))
        C[i] = 0.0
    solved = np.linalg.solve(A, np.column_stack([b, C])).astype(np.float64, copy=False)
    step, by_shared = -solved[:, 0], -solved[:, 1:]
    return EliminatedPose(step, by_shared, H[n:, n:] + C.T @ by_shared, g[n:] + C.T @ step)


def solve_free(A: Array, b: Array, held: Mask) -> Array:
    """Return x (n,) with A x = b for free parameters, and zero for `held` (n,) ones."""
    A, b = A.copy(), b.copy()
    for i in np.flatnonzero(held):
        hold_parameter(A, b, int(i))
    return np.asarray(np.linalg.solve(A, b), dtype=np.float64)
