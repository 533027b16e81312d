"""Chroma bins: the table of colours and the counts against a direct conversion."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.geometry.rectangle import Rect
from depthtrack.segmentation.chroma import BINS, bins_of_colours, count_colours
from depthtrack.segmentation.options import SkinColourOptions

DARKEST, BRIGHTEST = SkinColourOptions().darkest, SkinColourOptions().brightest


def slow_bin(r: int, g: int, b: int) -> int:
    """Return the flat bin of the quantised colour; -1 if its luminance is out of range."""
    red, green, blue = (8 * (level // 8) + 3.5 for level in (r, g, b))
    y = 0.299 * red + 0.587 * green + 0.114 * blue
    u = 128 - 0.168736 * red - 0.331264 * green + 0.5 * blue
    v = 128 + 0.5 * red - 0.418688 * green - 0.081312 * blue
    if not DARKEST <= y <= BRIGHTEST:
        return -1
    return int(u * BINS / 256 + 1e-9) * BINS + int(v * BINS / 256 + 1e-9)


@given(st.integers(0, 255), st.integers(0, 255), st.integers(0, 255))
def test_each_colour_has_the_bin_of_the_definition(r: int, g: int, b: int) -> None:
    assert bins_of_colours(DARKEST, BRIGHTEST)[(r >> 3) << 10 | (g >> 3) << 5 | b >> 3] == slow_bin(r, g, b)


@given(seed=st.integers(0, 2**32 - 1))
def test_counts_equal_a_loop_over_pixels(seed: int) -> None:
    rng = np.random.default_rng(seed)
    image = rng.integers(0, 256, (9, 12, 3), dtype=np.uint8)
    window, step = Rect(2, 1, 11, 8), 2
    skin = rng.integers(0, 2, (7, 9)).astype(np.uint8)
    hand = rng.random((7, 9)) < 0.5
    expected = np.zeros((2, BINS * BINS))
    for v in range(0, 7, step):
        for u in range(0, 9, step):
            chroma = slow_bin(*map(int, image[v + 1, u + 2]))
            if chroma >= 0 and bool(skin[v, u]) == hand[v, u]:
                expected[int(hand[v, u]), chroma] += 1
    counts = np.zeros_like(expected)
    count_colours(image, tuple(window), skin, hand, step, bins_of_colours(DARKEST, BRIGHTEST), counts)
    np.testing.assert_array_equal(counts, expected)
