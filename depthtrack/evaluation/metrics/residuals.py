"""How well a pose explains what the sensor saw, without any annotation: E3D, E2D and the silhouettes' overlap."""

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.spatial import cKDTree

from depthtrack.evaluation.metrics.metric import Metric
from depthtrack.types import Array, Mask


@dataclass(frozen=True)
class Residuals:
    """The label-free metrics of a run, each (T,); NaN where a frame has no pose or no observed hand."""

    e3d: Array
    e2d: Array
    iou: Array

    def metrics(self) -> tuple[Metric, Metric, Metric]:
        """With their names and units."""
        return (
            Metric("e3d_mm", "mm", self.e3d),
            Metric("e2d_px", "px", self.e2d),
            Metric("silhouette_iou", "", self.iou, higher_is_better=True),
        )


def e3d(points: Array, model_points: Array) -> float:
    """Mean distance of observed points (N, 3) to the nearest of the model's visible surface (M, 3): mm, from metres.

    E3D of Tkach, Pauly and Tagliasacchi, "Sphere-meshes for real-time hand modeling and tracking", SIGGRAPH Asia
    2016. NaN without observed points, infinite without a visible model.
    """
    if len(points) == 0:
        return float("nan")
    if len(model_points) == 0:
        return float("inf")
    # A tidy tree would not pay for one pass over the points.
    tree = cKDTree(model_points, balanced_tree=False, compact_nodes=False)
    distances, _ = tree.query(points)
    return float(1000 * np.mean(distances))


def e2d(rendered: Mask, observed: Mask) -> float:
    """Mean distance of the rendered pixels outside the observed silhouette to it, pixels; maps (h, w).

    E2D of Tkach et al. 2016, as Euclidean distance; their code takes half the city-block distance. 0 where none lies
    outside, NaN without an observed silhouette.
    """
    if not observed.any():
        return float("nan")
    outside = rendered & ~observed
    if not outside.any():
        return 0.0
    distance = cv2.distanceTransform((~observed).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    return float(distance[outside].mean())


def silhouette_iou(first: Mask, second: Mask) -> float:
    """Return the intersection over union of two silhouettes (h, w), the index of Jaccard 1912.

    Two empty silhouettes agree: their IoU is 1.
    """
    union = int(np.count_nonzero(first | second))
    return np.count_nonzero(first & second) / union if union else 1.0
