"""Correspondences: for each observed point, the closest point of the hand's surface that the camera can see."""

from typing import NamedTuple, Protocol

import numpy as np

from depthtrack.hand.compiled_kinematics import BodyPoses
from depthtrack.segmentation.observation import Observation
from depthtrack.types import Array, Index


class PointCloud(NamedTuple):
    """Observed points (N, 3), metres, camera frame, and their unit normals (N, 3) towards the camera."""

    points: Array
    normals: Array

    @staticmethod
    def of(observation: Observation, every: int) -> "PointCloud":
        """Every so many-th point of an observation: uniform subsampling (Schroeder et al. 2014, Sec. VI-B)."""
        pick = slice(every // 2, None, every)
        return PointCloud(
            np.ascontiguousarray(observation.points[pick]), np.ascontiguousarray(observation.normals[pick])
        )


class Correspondences(NamedTuple):
    """What each observed point is matched to: `body` (N,) that moves the surface there, -1 for none; the surface's
    point `x` (N, 3) and its outward unit normal `n` (N, 3), camera frame."""

    body: Index
    x: Array
    n: Array

    @staticmethod
    def allocate(count: int) -> "Correspondences":
        """Room for so many."""
        return Correspondences(np.full(count, -1), np.zeros((count, 3)), np.zeros((count, 3)))


class Surface(Protocol):
    """A hand's surface that observed points can be matched to."""

    def set_target(self, observation: Observation, cloud: PointCloud, max_distance: float) -> None:
        """Prepare for matches with points of this cloud; none will be further than `max_distance` (m)."""
        ...

    def match(
        self,
        pose: Array,
        bodies: BodyPoses,
        cloud: PointCloud,
        min_normal_cosine: float,
        correspondences: Correspondences,
    ) -> None:
        """The closest seen points of the hand in `pose` (27,), whose `bodies` are already placed, into
        `correspondences`.

        Only surface whose normal agrees with the observed one counts: `min_normal_cosine` is the least cosine between
        them.
        """
        ...
