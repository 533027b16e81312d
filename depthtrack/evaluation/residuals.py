"""Residuals of a run without ground truth: observed hand and posed model in every frame."""

from collections.abc import Iterable

import numpy as np

from depthtrack.evaluation.metrics.residuals import Residuals, e2d, e3d, silhouette_iou
from depthtrack.evaluation.replay import ReplayedFrame
from depthtrack.geometry.camera import Camera
from depthtrack.rendering.hand_surface import HandSurface
from depthtrack.rendering.options import Objective
from depthtrack.segmentation.observation import Observation
from depthtrack.types import Array, Mask

_SPACING = 0.001
"""Spacing of the points on the model's surface, m, at which the nearest point stands for the surface."""
_LARGEST_FACTOR = 5
"""Largest factor on the resolution of the camera."""


def run_residuals(replayed: Iterable[ReplayedFrame], surface: HandSurface, rows: int) -> Residuals:
    """Return E3D, E2D and silhouette IoU of the frames of a run.

    rows: number of frames of the run.
    """
    values = np.full((3, rows), np.nan)
    for each in replayed:
        if each.estimate.pose is not None and each.observation is not None:
            values[:, each.row] = frame_residuals(surface, each.estimate.pose, each.observation, each.frame.camera)
    return Residuals(*values)


def frame_residuals(
    surface: HandSurface, pose: Array, observation: Observation, camera: Camera
) -> tuple[float, float, float]:
    """Return E3D (mm), E2D (pixels) and silhouette IoU of one pose.

    pose: (27,).
    camera: camera of the whole image.
    """
    observed = observation.whole_mask(camera.shape)
    rendered = visible_silhouette(surface, pose, observation, camera)
    model_points = visible_points(surface, pose, camera)
    return e3d(observation.points, model_points), e2d(rendered, observed), silhouette_iou(rendered, observed)


def visible_silhouette(surface: HandSurface, pose: Array, observation: Observation, camera: Camera) -> Mask:
    """Return the pixels (h, w) that the posed hand covers and no object hides.

    pose: (27,).
    camera: camera of the whole image.
    """
    rendered = surface.silhouette(pose, camera)
    if observation.occluder is None:
        return rendered
    depth = surface.render(pose, observation.camera).depth.astype(np.float32)
    hidden = (depth > 0) & (observation.unhidden(depth, Objective().hidden_depth) == 0)
    return rendered & ~observation.region.paste(hidden, camera.rect)


def visible_points(surface: HandSurface, pose: Array, camera: Camera) -> Array:
    """Return points of the visible surface, about 1 mm apart.

    pose: (27,).
    returns: (M, 3), m, camera frame.
    """
    region = surface.bounds(pose, camera)
    if region.is_empty:
        return np.empty((0, 3))
    spacing = float(pose[2]) / camera.fx
    factor = int(np.clip(np.ceil(spacing / _SPACING), 1, _LARGEST_FACTOR))
    # An odd factor keeps the rays of the sensor's own pixels.
    fine = camera.crop(region).resized(factor + (factor + 1) % 2)
    depth = surface.render(pose, fine).depth
    v, u = np.nonzero(depth)
    return fine.unproject(np.stack([u, v], axis=-1), depth[v, u])
