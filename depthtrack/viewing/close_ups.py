"""Close-up regions of the hand in a run: one size, on a smoothed path."""

import numpy as np
from scipy.ndimage import gaussian_filter1d

from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rectangle import Rect
from depthtrack.types import Array, Mask

_SMOOTHING_FRAMES = 6.0
"""Standard deviation of the Gaussian that smooths the region's path, frames."""
_MARGIN_FACTOR = 1.35
"""Size of the region relative to the hand's 90th percentile."""
_SMALLEST = 24
"""Smallest side of a region, pixels."""


def close_up_regions(camera: Camera, keypoints: Array, trusted: Mask) -> list[Rect]:
    """Return one region per frame, all with one size and the image's aspect ratio.

    Without a trusted pose, the regions are the whole image.

    keypoints (T, 21, 3): metres, camera frame, NaN without a pose.
    trusted (T,): frames whose pose the regions follow.
    """
    pixels = camera.project(keypoints)
    usable = trusted & np.isfinite(pixels).all(axis=(1, 2))
    if not usable.any():
        return [camera.rect] * len(keypoints)
    low, high = pixels[usable].min(axis=1), pixels[usable].max(axis=1)
    extent = np.percentile((high - low) / [camera.width, camera.height], 90, axis=0).max()
    share = float(np.clip(_MARGIN_FACTOR * extent, _SMALLEST / min(camera.shape), 1.0))
    width, height = round(share * camera.width), round(share * camera.height)
    rows = np.arange(len(keypoints))
    path = np.stack([np.interp(rows, rows[usable], ((low + high) / 2)[:, axis]) for axis in (0, 1)], axis=-1)
    centres = gaussian_filter1d(path, _SMOOTHING_FRAMES, axis=0, mode="nearest")
    return [Rect.of_size(round(x - width / 2), round(y - height / 2), width, height) for x, y in centres]
