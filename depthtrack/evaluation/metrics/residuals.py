"""Residuals between observation and posed model, without ground truth: E3D, E2D, IoU."""

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.spatial import cKDTree

from depthtrack.evaluation.metrics.metric import Metric
from depthtrack.types import Array, Mask


@dataclass(frozen=True)
class Residuals:
    """Residuals of a run; NaN if a frame has no pose or no observed hand.

    e3d: (T,), mm.
    e2d: (T,), pixels.
    iou: (T,).
    """

    e3d: Array
    e2d: Array
    iou: Array

    def metrics(self) -> tuple[Metric, Metric, Metric]:
        """Return the residuals with names and units."""
        return (
            Metric("e3d_mm", "mm", self.e3d),
            Metric("e2d_px", "px", self.e2d),
            Metric("silhouette_iou", "", self.iou, higher_is_better=True),
        )


def e3d(points: Array, model_points: Array) -> float:
    """Return the mean distance of observed points from the nearest model point, mm.

    points: (N, 3) observed, m.
    model_points: (M, 3) on the visible surface of the model, m.

    The result is NaN without observed points, and infinite without model points. This is E3D of Tkach, Pauly and
    Tagliasacchi, "Sphere-meshes for real-time hand modeling and tracking", SIGGRAPH Asia 2016.
    """
    if len(points) == 0:
        return float("nan")
    if len(model_points) == 0:
        return float("inf")
    # Balancing the tree costs more than it saves in one pass over the points.
    tree = cKDTree(model_points, balanced_tree=False, compact_nodes=False)
    distances, _ = tree.query(points)
    return float(1000 * np.mean(distances))


def e2d(rendered: Mask, observed: Mask) -> float:
    """Return the mean distance of pixels rendered outside the observed silhouette from it.

    rendered, observed: (h, w) silhouettes.

    The unit is pixels. The result is 0 if no pixel is outside, and NaN without an observed silhouette. This is E2D of
    Tkach et al. 2016 with the Euclidean distance; their code uses half the city-block distance.
    """
    if not observed.any():
        return float("nan")
    outside = rendered & ~observed
    if not outside.any():
        return 0.0
    distance = cv2.distanceTransform((~observed).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    return float(distance[outside].mean())


def silhouette_iou(first: Mask, second: Mask) -> float:
    """Return the intersection over union of two silhouettes, the index of Jaccard 1912.

    first, second: (h, w). The IoU of two empty silhouettes is 1.
    """
    union = int(np.count_nonzero(first | second))
    return np.count_nonzero(first & second) / union if union else 1.0
