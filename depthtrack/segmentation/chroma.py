"""Chroma bins: U and V of YUV index the colour statistics.

Luminance is left out, because it changes most with the light.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from depthtrack.compilation import compiled
from depthtrack.geometry.rectangle import Rect
from depthtrack.types import Array, Image, Labels, Mask

BINS, LEVELS = 64, 32
"""Bins along U and along V, and levels of quantised R, G and B in the table of bins."""

# Rows Y, U and V of the full-range YUV of JPEG (ITU-R BT.601); U and V are 0 for greys.
LUMINANCE = np.array([0.299, 0.587, 0.114])
CHROMA = np.array([[-0.168736, -0.331264, 0.5], [0.5, -0.418688, -0.081312]])


@cache
def bins_of_colours(darkest: float, brightest: float) -> NDArray[np.int16]:
    """Return the flat U and V bin (32768,) of each quantised colour.

    It is -1 if the luminance is out of range.

    darkest, brightest: range of luminances with a meaningful chroma.
    """
    level = np.arange(LEVELS) * 8 + 3.5
    rgb = np.stack(np.meshgrid(level, level, level, indexing="ij"), axis=-1).reshape(-1, 3)
    # Greys lie on a bin's edge: rounding must not scatter them.
    u, v = np.clip((rgb @ CHROMA.T + 128) * BINS / 256 + 1e-9, 0, BINS - 1).astype(np.int16).T
    luminance = rgb @ LUMINANCE
    return np.where((luminance >= darkest) & (luminance <= brightest), u * BINS + v, np.int16(-1)).astype(np.int16)


def count_chroma(
    image: Image, region: Rect, skin: Labels, hand: Mask, step: int, bin_of_colour: NDArray[np.int16]
) -> Array:
    """Return the counts of pixels in neither of two masks and in both, by U and V bin.

    image: (H, W, 3), RGB.
    skin, hand: (h, w) over the region.
    step: subsampling of rows and columns.
    bin_of_colour: from `bins_of_colours`.
    counts: (2, 64, 64).
    """
    counts = np.zeros((2, BINS * BINS))
    count_colours(image, tuple(region), skin, hand, step, bin_of_colour, counts)
    return counts.reshape(2, BINS, BINS)


@compiled()
def count_colours(
    image: Image,
    region: tuple[int, int, int, int],
    skin: Labels,
    hand: Mask,
    step: int,
    bin_of_colour: NDArray[np.int16],
    counts: Array,
) -> None:
    """Count the pixels of a region on which two masks agree, by class and bin.

    image: (H, W, 3), RGB.
    region: left, top, right, bottom, pixels.
    skin, hand: (h, w) over the region.
    step: subsampling of rows and columns.
    bin_of_colour: (32768,) from `bins_of_colours`.
    counts: (2, 4096), added to in place: of pixels in neither mask, and in both.
    """
    left, top, _, _ = region
    for v in range(0, skin.shape[0], step):
        for u in range(0, skin.shape[1], step):
            if (skin[v, u] != 0) == hand[v, u]:
                chroma = bin_of_colour[colour_index(image, top + v, left + u)]
                if chroma >= 0:
                    counts[int(hand[v, u]), chroma] += 1


@compiled(inline="always")
def colour_index(image: Image, y: int, x: int) -> int:
    """Return the index of the quantised colour of a pixel of an RGB image (H, W, 3)."""
    return (int(image[y, x, 0]) >> 3) << 10 | (int(image[y, x, 1]) >> 3) << 5 | int(image[y, x, 2]) >> 3
