"""Placement of names beside the points of a picture, so that they cover little."""

import numpy as np

from depthtrack.types import Array

_RINGS = (0.0, 14.0, 30.0, 50.0, 74.0)
"""Distances of a name from its nearest place, pixels."""
_DIRECTIONS = 16
_OVERLAP, _COVERED = 4.0, 60.0
"""Cost of a pixel of another name, and of a covered point, in pixels of distance."""
_INWARD = 12.0
"""Cost of a place towards the middle of the points, pixels."""


def place_names(points: Array, sizes: Array, shape: tuple[int, int], clearance: float) -> Array:
    """Return the left upper corner (N, 2) of each name.

    Names are placed one after the other, outward from the middle of the points, where they cover the least.

    points: (N, 2) pixels.
    sizes: (N, 2) width and height of the names, pixels.
    shape: height and width of the picture, pixels.
    clearance: distance of a name from its own point, pixels.
    """
    corners = np.zeros((len(points), 2))
    if len(points) == 0:
        return corners
    middle = points.mean(axis=0)
    angles = np.arange(_DIRECTIONS) * 2 * np.pi / _DIRECTIONS
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    order = np.argsort(-np.linalg.norm(points - middle, axis=1), kind="stable")
    placed: list[int] = []
    for n in order:
        outward = (points[n] - middle) / max(float(np.linalg.norm(points[n] - middle)), 1e-9)
        candidates, costs = [], []
        for ring in _RINGS:
            for direction in directions:
                centre = points[n] + direction * (clearance + ring) + direction * sizes[n] / 2
                corner = centre - sizes[n] / 2
                candidates.append(corner)
                costs.append(ring + _INWARD * (1 - float(direction @ outward)))
        tried = np.array(candidates)
        total = np.array(costs)
        total += _OVERLAP * np.sqrt(_overlap(tried, sizes[n], corners[placed], sizes[placed]).sum(axis=1))
        total += _COVERED * _covers(tried, sizes[n], points).sum(axis=1)
        total += 1e6 * np.any((tried < 0) | (tried + sizes[n] > [shape[1], shape[0]]), axis=1)
        corners[n] = tried[int(np.argmin(total))]
        placed.append(int(n))
    return corners


def _overlap(corners: Array, size: Array, others: Array, other_sizes: Array) -> Array:
    """Return the areas (C, P) that boxes of one size share with other boxes, pixels."""
    low = np.maximum(corners[:, None], others[None])
    high = np.minimum(corners[:, None] + size, (others + other_sizes)[None])
    return np.asarray(np.prod(np.maximum(high - low, 0), axis=-1))


def _covers(corners: Array, size: Array, points: Array) -> Array:
    """Return whether boxes of one size cover points (C, N)."""
    inside = (points[None] > corners[:, None] - 2) & (points[None] < corners[:, None] + size + 2)
    return np.asarray(inside.all(axis=-1), dtype=np.float64)
