"""Chroma bins: U and V of YUV, by which skin colour is looked up, because luminance changes most with the light."""

from functools import cache

import numba
import numpy as np
from numpy.typing import NDArray

from depthtrack.geometry.rectangle import Rect
from depthtrack.types import Array, Image, Labels, Mask

BINS, LEVELS = 64, 32
"""Bins along U and along V, and levels to which R, G and B are quantised for the table of bins."""

DARKEST, BRIGHTEST = 20, 250
"""Outside these luminances chroma is meaningless: sensor noise or saturation determines it."""

# Rows Y, U and V of the full-range YUV of JPEG (ITU-R BT.601); U and V are 0 for greys.
LUMINANCE = np.array([0.299, 0.587, 0.114])
CHROMA = np.array([[-0.168736, -0.331264, 0.5], [0.5, -0.418688, -0.081312]])


@cache
def bins_of_colours() -> NDArray[np.int16]:
    """Return the flat U and V bin (32768,) of each quantised colour; -1 if its luminance is out of range."""
    level = np.arange(LEVELS) * 8 + 3.5
    rgb = np.stack(np.meshgrid(level, level, level, indexing="ij"), axis=-1).reshape(-1, 3)
    # Greys lie on a bin's edge: rounding must not scatter them.
    u, v = np.clip((rgb @ CHROMA.T + 128) * BINS / 256 + 1e-9, 0, BINS - 1).astype(np.int16).T
    luminance = rgb @ LUMINANCE
    return np.where((luminance >= DARKEST) & (luminance <= BRIGHTEST), u * BINS + v, np.int16(-1)).astype(np.int16)


def count_chroma(image: Image, region: Rect, skin: Labels, hand: Mask, step: int) -> Array:
    """Return the counts (2, 64, 64) by U and V bin of pixels in neither skin nor hand, and of pixels in both.

    `step` subsamples rows and columns of the region.
    """
    counts = np.zeros((2, BINS * BINS))
    count_colours(image, tuple(region), skin, hand, step, bins_of_colours(), counts)
    return counts.reshape(2, BINS, BINS)


@numba.njit(cache=True)
def count_colours(
    image: Image,
    region: tuple[int, int, int, int],
    skin: Labels,
    hand: Mask,
    step: int,
    bin_of_colour: NDArray[np.int16],
    counts: Array,
) -> None:
    """Add to `counts` (2, 4096) the pixels of a region on which `skin` and `hand` (h, w) agree, by class and bin."""
    left, top, _, _ = region
    for v in range(0, skin.shape[0], step):
        for u in range(0, skin.shape[1], step):
            if (skin[v, u] != 0) == hand[v, u]:
                chroma = bin_of_colour[colour_index(image, top + v, left + u)]
                if chroma >= 0:
                    counts[int(hand[v, u]), chroma] += 1


@numba.njit(cache=True, inline="always")
def colour_index(image: Image, y: int, x: int) -> int:
    return (int(image[y, x, 0]) >> 3) << 10 | (int(image[y, x, 1]) >> 3) << 5 | int(image[y, x, 2]) >> 3
