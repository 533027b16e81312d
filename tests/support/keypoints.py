"""Keypoints of synthetic frames with errors, for tests of everything that takes them."""

import numpy as np

from depthtrack.recording.sequence import ImageKeypoints
from depthtrack.segmentation.observation import Observation
from depthtrack.synthesis.generate import Synthesiser
from depthtrack.types import Array


def keypoints_of(
    made: Synthesiser, index: int, noise: float = 0.0, missing: float = 0.0, swapped: tuple[int, int] | None = None
) -> ImageKeypoints:
    """Return the projected true keypoints of a frame.

    noise: standard deviation, pixels.
    missing: share of unknown keypoints.
    swapped: two fingers (0 to 4) that take each other's place.
    """
    rng = np.random.default_rng(index)
    pixels = made.sensor.camera.project(made.joints[index]) + noise * rng.standard_normal((21, 2))
    pixels[rng.random(21) < missing] = np.nan
    if swapped is not None:
        one, other = (slice(1 + 4 * finger, 5 + 4 * finger) for finger in swapped)
        pixels[one], pixels[other] = pixels[other].copy(), pixels[one].copy()
    return ImageKeypoints(pixels, np.where(np.isfinite(pixels).all(axis=-1), 0.9, 0.0))


def in_region(keypoints: ImageKeypoints, observation: Observation) -> ImageKeypoints:
    """Return keypoints of the frame in the region of an observation."""
    return keypoints.shifted(observation.region.left, observation.region.top)


def mirrored(keypoints: ImageKeypoints) -> ImageKeypoints:
    """Return keypoints with those of the thumb's side in place of those of the other side."""
    order = np.array([0, *(1 + 4 * finger + point for finger in range(4, -1, -1) for point in range(4))])
    return ImageKeypoints(keypoints.pixels[order], keypoints.confidence[order], keypoints.side)


def mean_error(points: Array, truth: Array) -> float:
    """Return the mean distance of points (..., 3) from others, metres."""
    return float(np.linalg.norm(points - truth, axis=-1).mean())
