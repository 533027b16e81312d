"""Shading of a rendered hand: one colour per finger, light from the upper left."""

import numpy as np

from depthtrack.hand.pose import FINGERS
from depthtrack.rendering.rendered_surface import RenderedSurface
from depthtrack.types import Image
from depthtrack.viewing.theme import FINGER_COLOURS, PALM

_LIGHT = np.array([-0.35, -0.5, -0.8]) / np.linalg.norm([-0.35, -0.5, -0.8])
_AMBIENT = 0.3
BODY_COLOURS = np.array([PALM, *(FINGER_COLOURS[finger] for finger in FINGERS for _ in range(3))], dtype=np.uint8)
"""RGB colours (16, 3) of the bodies."""


def draw_surface(image: Image, surface: RenderedSurface, opacity: float = 1.0) -> Image:
    """Draw a rendered hand, labelled by body, over an image (h, w, 3)."""
    hit = surface.label >= 0
    light = _AMBIENT + (1 - _AMBIENT) * np.maximum(surface.normal[hit] @ _LIGHT, 0)
    out = image.copy()
    out[hit] = np.rint(image[hit] * (1 - opacity) + BODY_COLOURS[surface.label[hit]] * light[:, None] * opacity)
    return out
