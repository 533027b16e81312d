"""Masks of the hand over a region of interest, which both ways of segmentation return."""

from dataclasses import dataclass

from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rectangle import Rect
from depthtrack.segmentation.options import OutlineOptions
from depthtrack.types import Mask


@dataclass(frozen=True)
class HandMasks:
    """Masks of the hand.

    region: region of interest in the frame, with a margin around the hand.
    silhouette: (h, w).
    readings: (h, w) pixels whose depth is the hand's.
    """

    region: Rect
    silhouette: Mask
    readings: Mask


def dilation_radius(camera: Camera, options: OutlineOptions) -> int:
    """Return the radius of the dilation of skin, pixels (Oikonomidis 2011, Sec. 2.1)."""
    return max(1, round(options.dilation * camera.width))
