"""Rigid alignment of corresponding points in closed form."""

import numpy as np
from numpy.typing import ArrayLike

from depthtrack.types import Array


def rigid_alignment(source: ArrayLike, target: ArrayLike, weights: ArrayLike | None = None) -> tuple[Array, Array]:
    """Return the rotation (..., 3, 3) and translation (..., 3) that best align two point sets.

    source, target: (..., N, 3) corresponding points, any unit.
    weights: (..., N) not negative, at least one positive; all 1 if None.

    Weighted least squares, never a reflection. Source: Horn, "Closed-form solution of
    absolute orientation", JOSA A 4(4), 1987, solved by the SVD of Kabsch, Acta Cryst. A32, 1976.
    """
    p, q = np.asarray(source, dtype=np.float64), np.asarray(target, dtype=np.float64)
    w = np.ones(q.shape[:-1]) if weights is None else np.asarray(weights, dtype=np.float64)
    w = w / np.sum(w, axis=-1, keepdims=True)
    p_mean, q_mean = (np.einsum("...n,...ni->...i", w, points) for points in (p, q))
    covariance = np.einsum("...n,...ni,...nj->...ij", w, q - q_mean[..., None, :], p - p_mean[..., None, :])
    U, _, Vt = np.linalg.svd(covariance)
    # The direction of least spread carries the sign, so that the determinant is +1.
    U[..., :, 2] *= np.sign(np.linalg.det(U) * np.linalg.det(Vt))[..., None]
    R = U @ Vt
    return R, q_mean - np.einsum("...ij,...j->...i", R, p_mean)
