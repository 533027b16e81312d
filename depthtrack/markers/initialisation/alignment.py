"""*Alignment and Scaling* of a model to a cluster (Maycock et al. 2015, Sec. III-A)."""

from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from depthtrack.geometry.alignment import rigid_alignment
from depthtrack.types import Array

SIGNS = tuple(np.diag([a, b, a * b]) for a, b in product((1.0, -1.0), repeat=2))
"""Signs of the eigenvectors: the four that are rotations, of eight in all."""


class CanonicalForm(NamedTuple):
    """Position, orientation and size of points.

    R: (3, 3) principal axes as columns, of descending variance, a rotation.
    t: (3,) metres, centre of gravity.
    extents: (3,) metres, edges of the oriented bounding box.
    """

    R: Array
    t: Array
    extents: Array


def canonical_form(points: Array) -> CanonicalForm:
    """Return T_s or T_t of Eq. (1) by principal component analysis of points (N, 3), metres."""
    centre = points.mean(axis=0)
    _, axes = np.linalg.eigh(np.cov((points - centre).T, bias=True))
    R = axes[:, ::-1].copy()
    R[:, 2] *= np.sign(np.linalg.det(R))
    local = (points - centre) @ R
    return CanonicalForm(R, centre, np.ptp(local, axis=0))


def box_scale(source: CanonicalForm, target: CanonicalForm, limits: tuple[float, float]) -> float:
    """Return the factor on the model from the diagonals of both oriented bounding boxes."""
    ratio = np.linalg.norm(target.extents) / max(float(np.linalg.norm(source.extents)), 1e-9)
    return float(np.clip(ratio, *limits))


def principal_alignments(source: CanonicalForm, target: CanonicalForm) -> list[tuple[Array, Array]]:
    """Return T_s^t = T_t T_s^-1, Eq. (1), for all signs of the eigenvectors."""
    rotations = [target.R @ S @ source.R.T for S in SIGNS]
    return [(R, target.t - R @ source.t) for R in rotations]


def mean_distance(source: Array, target: Array) -> float:
    """Return the mean distance of points (N, 3) to the nearest target (K, 3), metres."""
    return float(np.mean(cKDTree(target).query(source)[0]))


def rigid_icp(source: Array, target: Array, R: Array, t: Array, iterations: int) -> tuple[Array, Array]:
    """Return rotation and translation refined by rigid ICP (Besl and McKay 1992).

    source: (N, 3), target: (K, 3) metres.
    """
    tree, last = cKDTree(target), None
    for _ in range(iterations):
        _, nearest = tree.query(source @ R.T + t)
        if last is not None and np.array_equal(nearest, last):
            break
        R, t = rigid_alignment(source, target[nearest])
        last = nearest
    return R, t
