"""Depth residuals as colours: observed depth nearer or farther than the hypothesis."""

import cv2
import numpy as np
from numpy.typing import NDArray

from depthtrack.types import Depth, Image, Mask
from depthtrack.viewing.theme import ESTIMATED_MASK, NO_READING

LARGEST = 0.02
"""Residual at the ends of the scale, metres."""
UNREAD = (71, 80, 94)
"""Colour of hypothesis pixels without an observed depth."""
UNCOVERED = ESTIMATED_MASK
"""Colour of observed hand pixels that the hypothesis does not cover."""


def residual_to_rgb(
    measured: NDArray[np.floating], rendered: NDArray[np.floating], observed: Mask | None = None
) -> Image:
    """Return the colours of depth residuals.

    White is 0, red an observed depth nearer than the hypothesis, blue farther.

    measured (h, w), rendered (h, w): metres; 0 without depth.
    observed (h, w): observed silhouette.
    Result (h, w, 3): RGB.
    """
    out = np.empty((*measured.shape, 3), dtype=np.uint8)
    out[:] = NO_READING
    if observed is not None:
        out[observed] = UNCOVERED
    hypothesis = rendered > 0
    out[hypothesis] = UNREAD
    both = hypothesis & (measured > 0)
    out[both] = _palette((measured - rendered)[both])
    return out


def residual_scale(width: int, height: int) -> Image:
    """Return the colour scale (height, width, 3) for a legend, nearer on the left."""
    return np.broadcast_to(_palette(np.linspace(-LARGEST, LARGEST, width)), (height, width, 3)).copy()


def _palette(difference: NDArray[np.floating]) -> Image:
    """Return RGB (..., 3) of residuals (...), metres."""
    position = np.clip(difference / LARGEST, -1, 1)[..., None]
    # A diverging scale through white; red and blue are distinct with colour vision deficiency.
    towards = np.where(position < 0, np.array([215, 48, 39]), np.array([49, 101, 200]))
    return np.rint(255 + (towards - 255) * np.sqrt(np.abs(position))).astype(np.uint8)


def enlarged(depth: NDArray[np.floating], width: int, height: int) -> Depth:
    """Resize a depth map by nearest neighbour, without averaging depths."""
    return cv2.resize(depth.astype(np.float32), (width, height), interpolation=cv2.INTER_NEAREST_EXACT).astype(
        np.float32, copy=False
    )
