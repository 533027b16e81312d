"""The output of a surface renderer: depth, label and normal of every pixel."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from depthtrack.geometry.camera import Camera
from depthtrack.types import Array

NEAR = 1e-3
"""Near plane, metres: anything closer is invisible."""


@dataclass
class RenderedSurface:
    """The nearest surface at every pixel of an image.

    depth: (h, w) metres along the optical axis, 0 = no hit.
    label: (h, w) of the primitive or face hit, -1 = no hit.
    normal: (h, w, 3) unit, towards the camera, camera frame.
    """

    depth: Array
    label: NDArray[np.int16]
    normal: Array

    @classmethod
    def empty(cls, camera: Camera) -> Self:
        """Return a surface without a hit."""
        h, w = camera.shape
        return cls(np.zeros((h, w)), np.full((h, w), -1, dtype=np.int16), np.zeros((h, w, 3)))
