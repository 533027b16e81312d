"""Depth maps as colour images: near is bright, far is dim, missing depth is darkest."""

import cv2
import numpy as np
from numpy.typing import NDArray

from depthtrack.types import Array, Depth, Image
from depthtrack.viewing.theme import NO_READING

NEAR_LIMIT = 0.1
"""Smallest valid depth, metres; nearer readings are sensor artefacts."""
_DEFAULT_RANGE = 0.3, 1.5
"""Near and far without any reading, metres."""


def depth_range(depth: Depth, percent: tuple[float, float] = (0.2, 98.0)) -> tuple[float, float]:
    """Return the robust range (near, far) of depth maps, metres.

    depth (...): metres.
    percent: percentiles of near and far, which reject outliers.
    The result is (0.3, 1.5) without any reading.
    """
    readings = depth[np.isfinite(depth) & (depth >= NEAR_LIMIT)]
    if readings.size == 0:
        return _DEFAULT_RANGE
    near, far = (float(value) for value in np.percentile(readings, percent))
    # A fronto-parallel plane would have an empty range.
    return near, max(far, near + 0.05)


def keypoint_depth_range(keypoints: Array, margin: float = 0.06) -> tuple[float, float]:
    """Return the range (near, far) of a hand's surface from its keypoints, metres.

    keypoints (..., 3): metres, camera frame.
    margin: added behind the farthest keypoints, metres.
    """
    depths = keypoints[..., 2]
    if depths.size == 0:
        return _DEFAULT_RANGE
    near, far = depth_range(depths.astype(np.float32), (1.0, 99.0))
    return max(near - 0.06, 0.05), far + margin


def depth_to_rgb(depth: Depth, near: float, far: float) -> Image:
    """Convert a depth map to colours, linear in inverse depth.

    depth (h, w): metres; 0 and non-finite values become NO_READING.
    near, far: ends of the scale, metres; depths outside are clipped.
    Result (h, w, 3): RGB, uint8.
    """
    has_reading = np.isfinite(depth) & (depth > 0)
    z = np.clip(np.where(has_reading, depth, far), near, far)
    brightness = (1 / z - 1 / far) / (1 / near - 1 / far)
    return np.where(has_reading[..., None], _palette(brightness), np.array(NO_READING, dtype=np.uint8))


def colour_scale(width: int, height: int) -> Image:
    """Return the colour scale (height, width, 3) for a legend, near on the left."""
    return np.broadcast_to(_palette(np.linspace(1, 0, width)), (height, width, 3)).copy()


def _palette(brightness: NDArray[np.floating]) -> Image:
    """Return RGB (..., 3) of values (...) in [0, 1], without the colour map's darkest eighth."""
    return _LOOKUP[np.rint(32 + 223 * brightness).astype(np.intp)]


# Inferno (N. Smith and S. van der Walt, 2015): perceptually uniform, also in grey and with colour vision deficiency.
_LOOKUP: Image = np.ascontiguousarray(
    cv2.applyColorMap(np.arange(256, dtype=np.uint8)[:, None], cv2.COLORMAP_INFERNO)[:, 0, ::-1]
)
