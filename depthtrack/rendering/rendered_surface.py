"""What a renderer of surfaces returns: depth, what was hit, and which way it faces."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from depthtrack.geometry.camera import Camera
from depthtrack.types import Array

NEAR = 1e-3
"""Nothing closer to the lens than this (metres) is seen."""


@dataclass
class RenderedSurface:
    """The nearest surface in every pixel of an image.

    `depth` (h, w) metres along the optical axis, 0 where nothing was hit; `label` (h, w) of the thing hit, -1 for
    nothing; `normal` (h, w, 3) unit, towards the camera, camera frame.
    """

    depth: Array
    label: NDArray[np.int16]
    normal: Array

    @classmethod
    def empty(cls, camera: Camera) -> Self:
        h, w = camera.shape
        return cls(np.zeros((h, w)), np.full((h, w), -1, dtype=np.int16), np.zeros((h, w, 3)))
