"""Close-ups of the hand of a run: regions of one size that follow it smoothly."""

import numpy as np
from scipy.ndimage import gaussian_filter1d

from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rectangle import Rect
from depthtrack.types import Array, Mask

_STEADY_FRAMES = 6.0
"""Standard deviation, in frames, of the smoothing of the region's path."""
_ROOM = 1.35
"""Size of the region over that of the hand's keypoints, most of the time."""
_LEAST = 24


def close_ups(camera: Camera, keypoints: Array, trusted: Mask) -> list[Rect]:
    """Return a region a frame, all of one size and the image's shape; the image if no frame has a trusted pose.

    keypoints (T, 21, 3): metres, camera frame, NaN without a pose.
    trusted (T,): frames whose pose the regions follow.
    """
    pixels = camera.project(keypoints)
    usable = trusted & np.isfinite(pixels).all(axis=(1, 2))
    if not usable.any():
        return [camera.rect] * len(keypoints)
    low, high = pixels[usable].min(axis=1), pixels[usable].max(axis=1)
    extent = np.percentile((high - low) / [camera.width, camera.height], 90, axis=0).max()
    share = float(np.clip(_ROOM * extent, _LEAST / min(camera.shape), 1.0))
    width, height = round(share * camera.width), round(share * camera.height)
    rows = np.arange(len(keypoints))
    path = np.stack([np.interp(rows, rows[usable], ((low + high) / 2)[:, axis]) for axis in (0, 1)], axis=-1)
    centres = gaussian_filter1d(path, _STEADY_FRAMES, axis=0, mode="nearest")
    return [Rect.of_size(round(x - width / 2), round(y - height / 2), width, height) for x, y in centres]
