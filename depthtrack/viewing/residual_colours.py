"""What a hypothesis does not explain, in colour: where the sensor saw something nearer, farther, or no hand at all."""

import cv2
import numpy as np
from numpy.typing import NDArray

from depthtrack.types import Depth, Image, Mask
from depthtrack.viewing.theme import ESTIMATED_MASK, NO_READING

LARGEST = 0.02
"""Metres at the ends of the scale."""
UNREAD = (71, 80, 94)
"""The hypothesis where the sensor has no reading."""
UNEXPLAINED = ESTIMATED_MASK
"""An observed hand where the hypothesis has none."""


def residual_to_rgb(
    measured: NDArray[np.floating], rendered: NDArray[np.floating], observed: Mask | None = None
) -> Image:
    """Colours (h, w, 3) of the difference of two depth maps (h, w), metres, 0 = none, where there is a hypothesis.

    White where they agree, red where the sensor saw something nearer than the hypothesis, blue where farther.
    `observed` (h, w) is the silhouette of the hand as it was seen.
    """
    out = np.empty((*measured.shape, 3), dtype=np.uint8)
    out[:] = NO_READING
    if observed is not None:
        out[observed] = UNEXPLAINED
    hypothesis = rendered > 0
    out[hypothesis] = UNREAD
    both = hypothesis & (measured > 0)
    out[both] = _palette((measured - rendered)[both])
    return out


def residual_scale(width: int, height: int) -> Image:
    """The scale itself (height, width, 3), from nearer on the left to farther."""
    return np.broadcast_to(_palette(np.linspace(-LARGEST, LARGEST, width)), (height, width, 3)).copy()


def _palette(difference: NDArray[np.floating]) -> Image:
    """RGB (..., 3) of differences (...) in metres."""
    position = np.clip(difference / LARGEST, -1, 1)[..., None]
    # Two straight lines through white: evenly bright on both sides, and red and blue to most colour-blind eyes.
    towards = np.where(position < 0, np.array([215, 48, 39]), np.array([49, 101, 200]))
    return np.rint(255 + (towards - 255) * np.sqrt(np.abs(position))).astype(np.uint8)


def enlarged(depth: NDArray[np.floating], width: int, height: int) -> Depth:
    """A depth map at another size, its readings picked, never averaged."""
    return cv2.resize(depth.astype(np.float32), (width, height), interpolation=cv2.INTER_NEAREST_EXACT).astype(
        np.float32, copy=False
    )
