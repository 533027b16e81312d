"""The label-free residuals of a whole run: its recording observed again, and held against the hand in every pose."""

from collections.abc import Iterable

import numpy as np

from depthtrack.evaluation.metrics.residuals import Residuals, e2d, e3d, silhouette_iou
from depthtrack.evaluation.replay import ReplayedFrame
from depthtrack.geometry.camera import Camera
from depthtrack.rendering.hand_surface import HandSurface
from depthtrack.segmentation.observation import Observation
from depthtrack.types import Array

_FINEST = 0.001
"""Metres between the points of the model's surface, at most: a distance to the nearest is one to the surface."""
_MOST_FINER = 5


def run_residuals(replayed: Iterable[ReplayedFrame], surface: HandSurface, rows: int) -> Residuals:
    """E3D, E2D and the silhouettes' overlap of a run of so many `rows`."""
    values = np.full((3, rows), np.nan)
    for moment in replayed:
        if moment.estimate.pose is not None and moment.observation is not None:
            values[:, moment.row] = frame_residuals(
                surface, moment.estimate.pose, moment.observation, moment.frame.camera
            )
    return Residuals(*values)


def frame_residuals(
    surface: HandSurface, pose: Array, observation: Observation, camera: Camera
) -> tuple[float, float, float]:
    """E3D (mm), E2D (pixels) and the overlap of the silhouettes for one pose (27,), in the whole image of `camera`."""
    observed = observation.whole_mask(camera.shape)
    rendered = surface.silhouette(pose, camera)
    model_points = visible_points(surface, pose, camera)
    return e3d(observation.points, model_points), e2d(rendered, observed), silhouette_iou(rendered, observed)


def visible_points(surface: HandSurface, pose: Array, camera: Camera) -> Array:
    """Points (M, 3) of the surface that `camera` sees, metres, about a millimetre apart or as far as its pixels are."""
    region = surface.bounds(pose, camera)
    if region.is_empty:
        return np.empty((0, 3))
    spacing = float(pose[2]) / camera.fx
    finer = int(np.clip(np.ceil(spacing / _FINEST), 1, _MOST_FINER))
    # An odd factor keeps the rays of the sensor's own pixels.
    close = camera.crop(region).resized(finer + (finer + 1) % 2)
    depth = surface.render(pose, close).depth
    v, u = np.nonzero(depth)
    return close.unproject(np.stack([u, v], axis=-1), depth[v, u])
