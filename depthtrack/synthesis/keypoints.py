"""2D keypoints of a synthetic hand, with the errors of a detector."""

from dataclasses import dataclass

import numpy as np

from depthtrack.errors import InputError
from depthtrack.geometry.camera import Camera
from depthtrack.hand.shape import Side
from depthtrack.recording.sequence import ImageKeypoints
from depthtrack.types import Array

_CONFIDENCE = (0.5, 1.0)
"""Range of the confidence of known keypoints, which states nothing about their errors."""


@dataclass(frozen=True)
class KeypointErrors:
    """Errors of synthetic keypoints.

    noise: standard deviation of each coordinate, pixels.
    missing: share of unknown keypoints, 0 to 1.
    swaps: share of the frames in which two neighbouring fingers take each other's place, 0 to 1.
    side: side that is stated, that of the hand if None.

    Raises:
        InputError: if a value is out of range.
    """

    noise: float = 0.0
    missing: float = 0.0
    swaps: float = 0.0
    side: Side | None = None

    def __post_init__(self) -> None:
        if not 0 <= self.noise <= 1000:
            raise InputError(f"the noise of keypoints must lie between 0 and 1000 pixels, found {self.noise:g}")
        for name, share in (("missing keypoints", self.missing), ("swapped fingers", self.swaps)):
            if not 0 <= share <= 1:
                raise InputError(f"{name} must lie between 0 and 100 %, found {100 * share:g} %")


def detected_keypoints(
    joints: Array, camera: Camera, side: Side, errors: KeypointErrors, rng: np.random.Generator
) -> ImageKeypoints:
    """Return keypoints as a detector with these errors finds them in an image.

    joints: (21, 3) metres, camera frame.
    side: of the hand.
    """
    pixels = camera.project(joints) + errors.noise * rng.standard_normal((21, 2))
    confidence = rng.uniform(*_CONFIDENCE, 21)
    missing = rng.random(21) < errors.missing
    first = 1 + 4 * int(rng.integers(0, 4))
    if rng.random() < errors.swaps:
        one, other = slice(first, first + 4), slice(first + 4, first + 8)
        pixels[one], pixels[other] = pixels[other].copy(), pixels[one].copy()
    pixels[missing], confidence[missing] = np.nan, 0.0
    return ImageKeypoints(pixels, confidence, errors.side or side)
