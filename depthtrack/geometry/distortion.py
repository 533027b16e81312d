"""Lens distortion, and images without it.

Sources: Brown, "Decentering distortion of lenses", 1966; the rational model is that of OpenCV, ROS and Azure Kinect.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import cv2
import numpy as np
from numpy.typing import NDArray

from depthtrack.errors import InputError
from depthtrack.geometry.camera import Camera
from depthtrack.types import Array, Depth, Image

_LARGEST = 1e3
"""Bound on a coefficient. The rational model of Azure Kinect has coefficients up to about 100."""
_WIDEST = 5.0
"""Radius, in units of the focal length, up to which a model is examined: 79 degrees from the axis."""
_SMALLEST_SHIFT = 0.05
"""Pixels that distortion must move a point to be removed."""
_STEP = 0.02
"""Relative range of depth within which neighbours belong to one surface, and are interpolated."""


@dataclass(frozen=True)
class Distortion:
    """Distortion of Brown and Conrady, with the rational radial factor.

    coefficients: (8,) k1, k2, p1, p2, k3, k4, k5, k6, as in OpenCV; shorter lists are filled with zeros.

    Raises:
        InputError: if there are more than eight, or one is out of range.
    """

    coefficients: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.coefficients) > 8 and any(self.coefficients[8:]):
            raise InputError(
                "lens distortion must have at most 8 coefficients (k1 k2 p1 p2 k3 k4 k5 k6),"
                f" found {len(self.coefficients)}"
            )
        values = tuple(float(value) for value in self.coefficients[:8])
        if not all(abs(value) <= _LARGEST for value in values):  # false for NaN
            raise InputError(f"coefficients of lens distortion must lie within +-{_LARGEST:g}, found {values}")
        object.__setattr__(self, "coefficients", (*values, *(0.0,) * (8 - len(values))))

    @classmethod
    def of(cls, model: str, coefficients: Sequence[float]) -> Self | None:
        """Return the distortion that ROS names `model`; None if it moves nothing.

        Raises:
            InputError: if the model is unknown or has other coefficients.
        """
        if not any(coefficients):
            return None
        if model not in ("plumb_bob", "rational_polynomial", ""):
            raise InputError(
                f"lens distortion must be plumb_bob or rational_polynomial, found {model[:40]!r}:"
                " undistort the images first, or give a --camera without distortion"
            )
        return cls(tuple(coefficients))

    def distort(self, x: NDArray[Any], y: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
        """Return the distorted position of rays (x, y, 1), in units of the focal length.

        A ray beyond `limit` becomes NaN.
        """
        p1, p2 = self.coefficients[2:4]
        r = x * x + y * y
        factor = np.where(r < self.limit, self._factor(r), np.nan)
        return (
            x * factor + 2 * p1 * x * y + p2 * (r + 2 * x * x),
            y * factor + p1 * (r + 2 * y * y) + 2 * p2 * x * y,
        )

    @cached_property
    def limit(self) -> float:
        """The squared radius up to which the model maps rays one to one: the distorted radius grows."""
        squared = np.linspace(0, _WIDEST**2, 1 << 14)
        with np.errstate(divide="ignore", invalid="ignore"):
            distorted = np.sqrt(squared) * self._factor(squared)
        folds = np.flatnonzero(~(np.diff(distorted) > 0))
        return float(squared[folds[0]] if len(folds) else squared[-1])

    def _factor(self, r: NDArray[Any]) -> Any:
        """Return the radial factor at squared radii."""
        k1, k2, _, _, k3, k4, k5, k6 = self.coefficients
        return (1 + r * (k1 + r * (k2 + r * k3))) / (1 + r * (k4 + r * (k5 + r * k6)))


class Undistortion:
    """Images of a pinhole camera from those of the same camera with lens distortion."""

    def __init__(self, camera: Camera, distortion: Distortion) -> None:
        u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
        x, y = distortion.distort((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy)
        across, down = camera.fx * x + camera.cx, camera.fy * y + camera.cy
        self.pixels: float = float(np.nan_to_num(np.hypot(across - u, down - v)).max())
        """Largest distance, pixels, that a point of the image moves."""
        # A place outside the image for rays beyond the model.
        self._across = np.nan_to_num(across, nan=-1e4).astype(np.float32)
        self._down = np.nan_to_num(down, nan=-1e4).astype(np.float32)

    @classmethod
    def needed(cls, camera: Camera, distortion: Distortion | None) -> Self | None:
        """Return the undistortion of a camera; None if it moves no point by a twentieth of a pixel."""
        undistortion = None if distortion is None else cls(camera, distortion)
        return None if undistortion is None or undistortion.pixels < _SMALLEST_SHIFT else undistortion

    @property
    def note(self) -> str:
        """Sentence for the user."""
        return f"lens distortion of up to {self.pixels:.1f} pixels is removed from the depth"

    def depth(self, depth: Depth) -> Depth:
        """Return depth (h, w) without distortion, metres, 0 = none.

        Depth is interpolated within a surface. Across its edge, and beside missing readings, the nearest reading is
        taken.
        """
        nearest, linear = self._sampled(depth, cv2.INTER_NEAREST), self._interpolated(depth)
        window = np.ones((3, 3), dtype=np.uint8)
        spread = cv2.dilate(depth, window) - cv2.erode(depth, window)
        smooth = self._sampled(spread, cv2.INTER_NEAREST) < _STEP * nearest
        return np.where(smooth & self._inside, linear, nearest)

    def _interpolated(self, depth: Depth) -> Depth:
        """Return depth (h, w) between its four neighbours; any value outside the image.

        OpenCV before 5.0 rounds places to a 32nd of a pixel.
        """
        (left, top), readings, width = self._corner, depth.ravel(), depth.shape[1]
        corner, u, v = top * width + left, self._across - np.float32(left), self._down - np.float32(top)
        above = readings.take(corner) * (1 - u) + readings.take(corner + 1) * u
        below = readings.take(corner + width) * (1 - u) + readings.take(corner + width + 1) * u
        return np.asarray(above * (1 - v) + below * v, dtype=np.float32)

    def colour(self, colour: Image) -> Image:
        """Return a colour image (h, w, 3) without distortion; black where nothing was seen."""
        return self._sampled(colour, cv2.INTER_LINEAR)

    @cached_property
    def _corner(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Column and row (h, w) of the first of four neighbours, within the image."""
        height, width = self._across.shape
        left, top = np.clip(np.floor(self._across), 0, width - 2), np.clip(np.floor(self._down), 0, height - 2)
        return left.astype(np.intp), top.astype(np.intp)

    @cached_property
    def _inside(self) -> NDArray[np.bool_]:
        """Pixels whose four neighbours lie in the image."""
        height, width = self._across.shape
        inside: NDArray[np.bool_] = (
            (self._across >= 0) & (self._across <= width - 1) & (self._down >= 0) & (self._down <= height - 1)
        )
        return inside

    def _sampled(self, image: NDArray[Any], interpolation: int) -> Any:
        return cv2.remap(image, self._across, self._down, interpolation, borderMode=cv2.BORDER_CONSTANT)


def rays(camera: Camera) -> tuple[Array, Array]:
    """Return the rays x (w,) of columns and y (h,) of rows, in units of the focal length."""
    columns, rows = (np.arange(side, dtype=np.float64) for side in (camera.width, camera.height))
    return np.asarray((columns - camera.cx) / camera.fx), np.asarray((rows - camera.cy) / camera.fy)
