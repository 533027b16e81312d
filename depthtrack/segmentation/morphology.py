"""Morphology of masks: discs, dilation, erosion, closing and bounding boxes."""

from functools import cache

import cv2
import numpy as np

from depthtrack.geometry.rectangle import Rect
from depthtrack.types import Labels, Mask

EXACT = 5
"""Largest radius of a disc that equals a square and a diamond, pixels."""


@cache
def disc(radius: int) -> Labels:
    """Return a round structuring element (2 radius + 1, 2 radius + 1)."""
    y, x = np.ogrid[-radius : radius + 1, -radius : radius + 1]
    # Half a pixel more, so that small discs are not pointed.
    return (x * x + y * y <= (radius + 0.5) ** 2 - 0.25).astype(np.uint8)


def dilated(mask: Mask, radius: int) -> Mask:
    """Return the pixels within `radius` pixels, at least 1, of a mask (h, w)."""
    square, diamond = _square_and_diamond(radius)
    return cv2.dilate(cv2.dilate(mask.view(np.uint8), square), diamond).view(np.bool_)


def eroded(mask: Mask, radius: int) -> Mask:
    """Return the pixels of a mask (h, w) farther than `radius` pixels from its complement.

    The radius is at least 1. The image's border does not erode.
    """
    square, diamond = _square_and_diamond(radius)
    return cv2.erode(cv2.erode(mask.view(np.uint8), square), diamond).view(np.bool_)


@cache
def _square_and_diamond(radius: int) -> tuple[Labels, Labels]:
    """Return a square and a diamond that together equal `disc(radius)`, at half the cost.

    They are exact up to `EXACT` pixels; beyond, they make an octagon.
    """
    half = max(1, round(radius * (np.sqrt(2) - 1)))
    y, x = np.ogrid[half - radius : radius - half + 1, half - radius : radius - half + 1]
    return np.ones((2 * half + 1, 2 * half + 1), np.uint8), (abs(x) + abs(y) <= radius - half).astype(np.uint8)


def closed(mask: Mask, radius: int) -> Mask:
    """Return the morphological closing of a mask (h, w) by a disc."""
    if 1 <= radius <= EXACT:
        return eroded(dilated(mask, radius), radius)
    return np.asarray(cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_CLOSE, disc(radius)) > 0)


def bounding_box(mask: Mask, margin: int) -> Rect:
    """Return the bounding box of a mask (h, w) with `margin` pixels around it, within the image."""
    return Rect.bounding(mask).grown(margin).clipped(Rect.of_image(mask.shape))
