"""Correspondences: the closest visible point of the hand for each observed point."""

from typing import NamedTuple, Protocol

import numpy as np

from depthtrack.hand.compiled_kinematics import BodyPoses
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
        return PointCloud(*observation.subsampled_cloud(every))


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


class Surface(Protocol):
    """Surface of the hand, for searches of correspondences."""

    def set_target(self, observation: Observation, cloud: PointCloud, max_distance: float) -> None:
        """Prepare searches for the points of a cloud.

        max_distance: largest distance of a correspondence, m.
        """
        ...

    def match(
        self,
        pose: Array,
        bodies: BodyPoses,
        cloud: PointCloud,
        min_normal_cosine: float,
        correspondences: Correspondences,
    ) -> None:
        """Write the closest visible points of the hand to `correspondences`.

        pose: (27,), in which `bodies` are placed already.
        min_normal_cosine: smallest cosine between the normals of surface and observation.
        """
        ...
