"""A rectangle of an image's pixels."""

from typing import NamedTuple, Self

import numpy as np

from depthtrack.geometry.camera import Camera
from depthtrack.types import Array, Mask


class Window(NamedTuple):
    """Pixels from `left` and `top`, included, to `right` and `bottom`, excluded."""

    left: int
    top: int
    right: int
    bottom: int

    @classmethod
    def whole(cls, camera: Camera) -> Self:
        """All of a camera's image."""
        return cls(0, 0, camera.width, camera.height)

    @classmethod
    def around(cls, camera: Camera, centre: Array, reach: float) -> Self:
        """What may see points within `reach` metres of `centre` (3,) across the line of sight; never empty."""
        (u, v), z = camera.project(centre), float(centre[2])
        du, dv = camera.fx * reach / z, camera.fy * reach / z
        left, top = min(max(int(u - du), 0), camera.width - 1), min(max(int(v - dv), 0), camera.height - 1)
        right, bottom = min(max(int(u + du), left) + 1, camera.width), min(max(int(v + dv), top) + 1, camera.height)
        return cls(left, top, right, bottom)

    @property
    def width(self) -> int:
        return self.right - self.left

    @property
    def height(self) -> int:
        return self.bottom - self.top

    @property
    def slices(self) -> tuple[slice, slice]:
        """Rows and columns, to index an image with."""
        return slice(self.top, self.bottom), slice(self.left, self.right)

    def grown(self, margin: int, camera: Camera) -> "Window":
        """With `margin` more pixels on every side, as far as the camera's image goes."""
        return Window(
            max(self.left - margin, 0),
            max(self.top - margin, 0),
            min(self.right + margin, camera.width),
            min(self.bottom + margin, camera.height),
        )

    def pasted(self, mask: Mask, outer: "Window") -> Mask:
        """`mask` (h, w) of this window as one of an `outer` window that holds it."""
        out = np.zeros((outer.height, outer.width), dtype=np.bool_)
        left, top = self.left - outer.left, self.top - outer.top
        out[top : top + self.height, left : left + self.width] = mask
        return out
