"""What a match asks of the hand: that the distance vanishes, or only its part along a normal; and how firmly."""

import math
from typing import Literal

import numba
import numpy as np

from depthtrack.tracking.ik.matching import Cloud, Matches
from depthtrack.tracking.ik.moments import Moments

Residual = Literal["point", "plane", "symmetric"]
"""`point`: x - y, as in Schroeder et al. 2014, Eq. (3). `plane`: along the hand's normal n (Chen and Medioni, "Object
modelling by registration of multiple range images", 1992). `symmetric`: along the mean of the hand's and the observed
normal, which vanishes on curved surfaces too (Rusinkiewicz, "A symmetric objective function for ICP", 2019)."""


def add_matches(moments: Moments, matches: Matches, cloud: Cloud, residual: Residual, softness: float) -> None:
    """Add the residuals of all matches.

    Each is weighted as Geman and McClure's estimator does: by 1 for near points, 1/4 at a distance of `softness` (m).
    A `softness` of 0 weighs all alike.
    """
    if residual == "point":
        add_points(moments, matches, cloud, softness)
    else:
        add_planes(moments, matches, cloud, softness, residual == "symmetric")


@numba.njit(cache=True, nogil=True)
def add_planes(moments: Moments, matches: Matches, cloud: Cloud, softness: float, symmetric: bool) -> None:
    """Add the distances of matches along normals: see `Residual`."""
    M, g, c = moments.M, moments.g, moments.centre
    x, n, y, m = matches.x, matches.n, cloud.points, cloud.normals
    a = np.empty(6)
    for i in range(matches.body.shape[0]):
        b = matches.body[i]
        if b < 0:
            continue
        nx, ny, nz = n[i, 0], n[i, 1], n[i, 2]
        if symmetric:
            nx, ny, nz = nx + m[i, 0], ny + m[i, 1], nz + m[i, 2]
            scale = 1.0 / math.sqrt(max(nx * nx + ny * ny + nz * nz, 1e-12))
            nx, ny, nz = nx * scale, ny * scale, nz * scale
        ex, ey, ez = x[i, 0] - y[i, 0], x[i, 1] - y[i, 1], x[i, 2] - y[i, 2]
        w, e = weight(ex, ey, ez, softness), nx * ex + ny * ey + nz * ez
        px, py, pz = x[i, 0] - c[0], x[i, 1] - c[1], x[i, 2] - c[2]
        a[0], a[1], a[2] = nx, ny, nz
        a[3], a[4], a[5] = py * nz - pz * ny, pz * nx - px * nz, px * ny - py * nx
        for j in range(6):
            wa = w * a[j]
            g[b, j] += wa * e
            for k in range(j + 1):
                M[b, j, k] += wa * a[k]
        moments.e[b] += w * e * e


@numba.njit(cache=True, nogil=True)
def add_points(moments: Moments, matches: Matches, cloud: Cloud, softness: float) -> None:
    """Add the distances of matches, all three coordinates."""
    M, g, c = moments.M, moments.g, moments.centre
    x, y = matches.x, cloud.points
    for i in range(matches.body.shape[0]):
        b = matches.body[i]
        if b < 0:
            continue
        ex, ey, ez = x[i, 0] - y[i, 0], x[i, 1] - y[i, 1], x[i, 2] - y[i, 2]
        px, py, pz = x[i, 0] - c[0], x[i, 1] - c[1], x[i, 2] - c[2]
        w = weight(ex, ey, ez, softness)
        # v shifts a point as it is, the turn by its product with p: the gradient of the coordinates is (1, -[p]x).
        M[b, 0, 0] += w
        M[b, 1, 1] += w
        M[b, 2, 2] += w
        M[b, 3, 1] -= w * pz
        M[b, 3, 2] += w * py
        M[b, 4, 0] += w * pz
        M[b, 4, 2] -= w * px
        M[b, 5, 0] -= w * py
        M[b, 5, 1] += w * px
        M[b, 3, 3] += w * (py * py + pz * pz)
        M[b, 4, 4] += w * (px * px + pz * pz)
        M[b, 5, 5] += w * (px * px + py * py)
        M[b, 4, 3] -= w * px * py
        M[b, 5, 3] -= w * px * pz
        M[b, 5, 4] -= w * py * pz
        g[b, 0] += w * ex
        g[b, 1] += w * ey
        g[b, 2] += w * ez
        g[b, 3] += w * (py * ez - pz * ey)
        g[b, 4] += w * (pz * ex - px * ez)
        g[b, 5] += w * (px * ey - py * ex)
        moments.e[b] += w * (ex * ex + ey * ey + ez * ez)


@numba.njit(cache=True, nogil=True)
def weight(ex: float, ey: float, ez: float, softness: float) -> float:
    """Geman and McClure's weight of a distance."""
    if softness <= 0.0:
        return 1.0
    share = 1.0 / (1.0 + (ex * ex + ey * ey + ez * ez) / (softness * softness))
    return share * share
