"""Rectangles of pixels: regions of interest, bounding boxes and crops."""

from typing import NamedTuple, Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from depthtrack.compilation import compiled
from depthtrack.types import Labels, Mask

Element = TypeVar("Element", bound=np.generic)


class Rect(NamedTuple):
    """The pixels from `left` and `top`, included, to `right` and `bottom`, excluded.

    A rectangle may extend outside the image. Compiled kernels take the same four integers in the same order.
    """

    left: int
    top: int
    right: int
    bottom: int

    @classmethod
    def of_size(cls, left: int, top: int, width: int, height: int) -> Self:
        """Return the rectangle of `width` by `height` pixels whose first pixel is (left, top)."""
        return cls(int(left), int(top), int(left) + int(width), int(top) + int(height))

    @classmethod
    def of_image(cls, shape: tuple[int, ...]) -> Self:
        """Return the rectangle of a whole image of `shape` (height, width, ...)."""
        return cls(0, 0, shape[1], shape[0])

    @classmethod
    def bounding(cls, mask: Mask) -> Self:
        """Return the bounding box of a mask (h, w), empty at the origin if the mask is empty."""
        return cls(*_bounds(np.ascontiguousarray(mask).view(np.uint8)))

    @classmethod
    def around(cls, pixels: ArrayLike, margin: ArrayLike = 0.0) -> Self:
        """Return the smallest rectangle that holds points and `margin` around them.

        pixels: (N, 2) finite image coordinates, pixels, at least one.
        margin: (2,) or a scalar, pixels along x and y.
        """
        points = np.asarray(pixels, dtype=np.float64)
        low = np.floor(points.min(axis=0) - margin)
        high = np.ceil(points.max(axis=0) + margin) + 1
        return cls(int(low[0]), int(low[1]), int(high[0]), int(high[1]))

    @property
    def width(self) -> int:
        """Columns."""
        return self.right - self.left

    @property
    def height(self) -> int:
        """Rows."""
        return self.bottom - self.top

    @property
    def shape(self) -> tuple[int, int]:
        """(height, width), as numpy orders an image."""
        return self.height, self.width

    @property
    def is_empty(self) -> bool:
        """True if the rectangle holds no pixel."""
        return self.width <= 0 or self.height <= 0

    @property
    def slices(self) -> tuple[slice, slice]:
        """Rows and columns that index an image which holds the whole rectangle."""
        return slice(self.top, self.bottom), slice(self.left, self.right)

    def shifted(self, dx: int, dy: int) -> "Rect":
        """Return the rectangle moved by `dx` columns and `dy` rows."""
        return Rect(self.left + dx, self.top + dy, self.right + dx, self.bottom + dy)

    def relative_to(self, outer: "Rect") -> "Rect":
        """Return the rectangle in the pixel coordinates of `outer`."""
        return self.shifted(-outer.left, -outer.top)

    def grown(self, margin: int) -> "Rect":
        """Return the rectangle with `margin` more pixels on every side."""
        return Rect(self.left - margin, self.top - margin, self.right + margin, self.bottom + margin)

    def scaled(self, factor: float) -> "Rect":
        """Return the rectangle with its edges multiplied by `factor` and rounded."""
        return Rect(*(round(edge * factor) for edge in self))

    def clipped(self, outer: "Rect") -> "Rect":
        """Return the part inside `outer`, empty at its border if there is none."""
        left, right = (min(max(x, outer.left), outer.right) for x in (self.left, self.right))
        top, bottom = (min(max(y, outer.top), outer.bottom) for y in (self.top, self.bottom))
        return Rect(left, top, right, bottom)

    def paste(self, part: NDArray[Element], outer: "Rect") -> NDArray[Element]:
        """Return an image of `outer` with `part` at this rectangle's place and zeros elsewhere.

        part: (height, width, ...) the image of this rectangle; pixels outside `outer` are dropped.
        """
        out = np.zeros((*outer.shape, *part.shape[2:]), dtype=part.dtype)
        common = self.clipped(outer)
        if not common.is_empty:
            out[common.relative_to(outer).slices] = part[common.relative_to(self).slices]
        return out

    def crop(self, image: NDArray[Element]) -> NDArray[Element]:
        """Return a copy of this rectangle of an image (h, w, ...), with zeros outside the image."""
        return Rect.of_image(image.shape).paste(image, self)


@compiled(nogil=True)
def _bounds(mask: Labels) -> tuple[int, int, int, int]:
    """Return the bounding box of a mask (h, w), zeros if it is empty."""
    height, width = mask.shape
    columns, top, bottom = np.zeros(width, np.uint8), height, 0
    for v in range(height):
        row, any_set = mask[v], np.uint8(0)
        for u in range(width):
            columns[u] |= row[u]
            any_set |= row[u]
        if any_set != 0:
            top, bottom = min(top, v), v + 1
    if bottom == 0:
        return 0, 0, 0, 0
    found = np.flatnonzero(columns)
    return found[0], top, found[-1] + 1, bottom
