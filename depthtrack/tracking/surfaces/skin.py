"""The skin mesh as a surface to fit."""

import numpy as np

from depthtrack.hand.shape import HandShape
from depthtrack.hand.skin.mesh import Skin
from depthtrack.solver.surface_points import SurfacePoints
from depthtrack.tracking.surfaces.points import subsample_evenly


def skin_points(shape: HandShape, spacing: float) -> SurfacePoints:
    """Return vertices of the hand's skin at least `spacing` palm lengths apart.

    All vertices, 1.8 mm apart, cost half as much again as at 2.4 mm and reduce the error by 0.05 degrees.

    Raises:
        InputError: if no skin fits the sizes of the hand.
    """
    return mesh_points(Skin.of(shape), spacing * shape.palm_length * shape.scale)


def mesh_points(skin: Skin, spacing: float = 0.0) -> SurfacePoints:
    """Return vertices of a skin at least `spacing` (m) apart, each with four bodies.

    The bodies are those with the largest weights.
    """
    pick = subsample_evenly(skin.rest, spacing) if spacing > 0 else np.arange(len(skin.rest))
    order = np.argsort(-skin.weights[pick], axis=1, kind="stable")[:, :4]
    weights = np.take_along_axis(skin.weights[pick], order, axis=1)
    return SurfacePoints(
        np.ascontiguousarray(skin.rest[pick]),
        np.ascontiguousarray(skin.normals(skin.rest)[pick]),
        np.ascontiguousarray(order),
        np.ascontiguousarray(weights / weights.sum(axis=1, keepdims=True)),
        np.ascontiguousarray(skin.T_body_rest[:, :3]),
    )
