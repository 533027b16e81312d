"""What a match asks of the hand: that the distance vanishes, or only its part along a normal; and how firmly."""

from typing import Literal

import numba
import numpy as np
from numpy.typing import NDArray

from depthtrack.tracking.ik.matching import Cloud, Matches
from depthtrack.tracking.ik.moments import Moments, add_planes, add_points

Array = NDArray[np.float64]
Residual = Literal["point", "plane", "symmetric"]
"""`point`: x - y, as in Schroeder et al. 2014, Eq. (3). `plane`: along the hand's normal n (Chen and Medioni, "Object
modelling by registration of multiple range images", 1992). `symmetric`: along the mean of the hand's and the observed
normal, which vanishes on curved surfaces too (Rusinkiewicz, "A symmetric objective function for ICP", 2019)."""


def add_matches(moments: Moments, matches: Matches, cloud: Cloud, residual: Residual, softness: float) -> None:
    """Add the residuals of all matches, weighted by `robust_weights`."""
    weights = robust_weights(matches, cloud, softness)
    if residual == "point":
        add_points(moments, matches.body, matches.x, cloud.points, weights)
    elif residual == "plane":
        add_planes(moments, matches.body, matches.x, cloud.points, matches.n, weights)
    else:
        add_planes(moments, matches.body, matches.x, cloud.points, mean_normals(matches, cloud), weights)


@numba.njit(cache=True, nogil=True)
def robust_weights(matches: Matches, cloud: Cloud, softness: float) -> Array:
    """Weights (N,) of Geman and McClure's estimator: 1 for near points, 1/4 at `softness` (m), 0 without a match.

    A `softness` of 0 weighs all alike.
    """
    x, y = matches.x, cloud.points
    out = np.zeros(x.shape[0])
    for i in range(x.shape[0]):
        if matches.body[i] >= 0:
            square = (x[i, 0] - y[i, 0]) ** 2 + (x[i, 1] - y[i, 1]) ** 2 + (x[i, 2] - y[i, 2]) ** 2
            out[i] = 1.0 if softness <= 0.0 else 1.0 / (1.0 + square / (softness * softness)) ** 2
    return out


@numba.njit(cache=True, nogil=True)
def mean_normals(matches: Matches, cloud: Cloud) -> Array:
    """Unit vectors (N, 3) halfway between the hand's normals and the observed ones."""
    out = np.empty((matches.body.shape[0], 3))
    for i in range(out.shape[0]):
        x, y, z = (
            matches.n[i, 0] + cloud.normals[i, 0],
            matches.n[i, 1] + cloud.normals[i, 1],
            matches.n[i, 2] + cloud.normals[i, 2],
        )
        scale = 1.0 / np.sqrt(max(x * x + y * y + z * z, 1e-12))
        out[i, 0], out[i, 1], out[i, 2] = x * scale, y * scale, z * scale
    return out
