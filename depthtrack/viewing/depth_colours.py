"""Depth maps in colour: near is bright, far is dim, no reading is darker than both."""

import cv2
import numpy as np
from numpy.typing import NDArray

from depthtrack.types import Depth, Image
from depthtrack.viewing.theme import NO_READING

NEAR_LIMIT = 0.1
"""Metres; nearer readings are sensor artefacts and must not stretch a range."""


def depth_range(depth: Depth, percent: tuple[float, float] = (0.2, 98.0)) -> tuple[float, float]:
    """Robust (near, far) in metres of the readings in depth maps of any shape.

    Percentiles, so that specks do not count. Without any reading the range is (0.3, 1.5) m, where hands are tracked.
    """
    readings = depth[np.isfinite(depth) & (depth >= NEAR_LIMIT)]
    if readings.size == 0:
        return 0.3, 1.5
    near, far = (float(value) for value in np.percentile(readings, percent))
    # A plane seen head-on still needs two ends to its scale.
    return near, max(far, near + 0.05)


def depth_to_rgb(depth: Depth, near: float, far: float) -> Image:
    """Colours (h, w, 3) uint8 RGB of a depth map (h, w) in metres, `near` brightest, `far` dimmest.

    Colours run linearly in 1/z, as disparity does: the hand, being near, gets most of them. Readings outside
    [near, far] take the colour of the nearer end; 0 and non-finite values are NO_READING.
    """
    has_reading = np.isfinite(depth) & (depth > 0)
    z = np.clip(np.where(has_reading, depth, far), near, far)
    brightness = (1 / z - 1 / far) / (1 / near - 1 / far)
    return np.where(has_reading[..., None], _palette(brightness), np.array(NO_READING, dtype=np.uint8))


def colour_scale(width: int, height: int) -> Image:
    """The scale itself (height, width, 3) for a legend, near on the left."""
    return np.broadcast_to(_palette(np.linspace(1, 0, width)), (height, width, 3)).copy()


def _palette(brightness: NDArray[np.floating]) -> Image:
    """RGB (..., 3) of values (...) in [0, 1]; the darkest eighth of the colour map is left to 'no reading'."""
    return _LOOKUP[np.rint(32 + 223 * brightness).astype(np.intp)]


# Inferno (N. Smith and S. van der Walt, 2015): lightness rises evenly, also in grey and to colour-blind eyes.
_LOOKUP: Image = np.ascontiguousarray(
    cv2.applyColorMap(np.arange(256, dtype=np.uint8)[:, None], cv2.COLORMAP_INFERNO)[:, 0, ::-1]
)
