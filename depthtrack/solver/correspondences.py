"""Correspondences: the closest visible point of the hand for each observed point."""

from typing import NamedTuple

import numpy as np

from depthtrack.segmentation.observation import Observation
from depthtrack.types import Array, Index


class PointCloud(NamedTuple):
    """Observed points with normals.

    points: (N, 3) metres, camera frame.
    normals: (N, 3) unit, camera frame, towards the camera.
    """

    points: Array
    normals: Array

    @staticmethod
    def of(observation: Observation, every: int) -> "PointCloud":
        """Return the points of an observation after uniform subsampling.

        every: step between the kept points (Schroeder et al. 2014, Sec. VI-B).
        """
        return observation.shared(("cloud", every), lambda: PointCloud(*observation.subsampled_cloud(every)))

    def subsampled(self, every: int) -> "PointCloud":
        """Return every n-th point, from the middle of the first n."""
        rows = slice(every // 2, None, every)
        return PointCloud(self.points[rows].copy(), self.normals[rows].copy())


class Correspondences(NamedTuple):
    """Surface points that correspond to the observed points.

    body: (N,) body that moves the surface there, -1 for no correspondence.
    x: (N, 3) metres, camera frame.
    n: (N, 3) outward unit normal, camera frame.
    """

    body: Index
    x: Array
    n: Array

    @staticmethod
    def allocate(count: int) -> "Correspondences":
        """Allocate correspondences for `count` points."""
        return Correspondences(np.full(count, -1), np.zeros((count, 3)), np.zeros((count, 3)))
