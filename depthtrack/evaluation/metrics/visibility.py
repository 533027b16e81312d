"""Errors of visible points, and of those that only the prior determines."""

from dataclasses import replace

import numpy as np

from depthtrack.evaluation.metrics.metric import Metric
from depthtrack.evaluation.metrics.points import PointErrors
from depthtrack.geometry.camera import Camera
from depthtrack.types import Array, Depth, Mask

DEEPEST_BELOW_SURFACE = 0.02
"""Metres: the thickest part of a hand, with a margin, between a joint's centre and the surface that shows it."""


def visible_points(points: Array, exact_depth: Depth, camera: Camera) -> Mask:
    """Return which points (P, 3) of the hand no surface hides, and lie within the image.

    points: metres, camera frame; a NaN counts as hidden.
    exact_depth: (h, w) noise-free depth of the scene, metres; 0 for none.
    """
    z = np.where(np.isfinite(points[:, 2]), points[:, 2], 1.0)
    u, v = (np.rint(each) for each in camera.project(np.nan_to_num(points, nan=1.0)).T)
    inside = (u >= 0) & (v >= 0) & (u < camera.width) & (v < camera.height) & np.isfinite(points).all(axis=1)
    front = np.zeros(len(points), dtype=np.float64)
    front[inside] = exact_depth[v[inside].astype(int), u[inside].astype(int)]
    return np.asarray(inside & ((front == 0) | (z - front < DEEPEST_BELOW_SURFACE)), dtype=np.bool_)


def visible_and_hidden(errors: PointErrors, visible: Mask) -> tuple[Metric, Metric]:
    """Return the mean errors of the visible and of the hidden points of each frame, mm.

    visible: (T, P).
    """
    shown, hidden = (
        replace(errors, metric=f"{name}_{errors.metric}", mm=np.where(part, errors.mm, np.nan))
        for name, part in (("visible", visible), ("hidden", ~visible))
    )
    return shown.mean(), hidden.mean()
