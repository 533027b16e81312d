"""Reconstruction error of all vertices of the skin (Schroeder et al. 2015, Sec. 4)."""

from typing import NamedTuple

import numpy as np

from depthtrack.hand.skin.mesh import Skin
from depthtrack.types import Array

_FRAMES = 32
"""Frames whose vertices are in memory at a time."""


class VertexErrors(NamedTuple):
    """Distances of the vertices of reconstructed hands from the true ones, metres.

    mean: (T,) of each frame over all vertices.
    largest: (T,) of each frame.
    """

    mean: Array
    largest: Array

    @staticmethod
    def between(skin: Skin, poses: Array, truth: Array) -> "VertexErrors":
        """Return the errors of poses (T, 27)."""
        mean, largest = np.empty(len(poses)), np.empty(len(poses))
        for first in range(0, len(poses), _FRAMES):
            part = slice(first, first + _FRAMES)
            distance = np.linalg.norm(skin.at(poses[part]) - skin.at(truth[part]), axis=-1)
            mean[part], largest[part] = distance.mean(axis=1), distance.max(axis=1)
        return VertexErrors(mean, largest)
