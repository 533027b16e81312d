"""Smooth text on images."""

from functools import lru_cache
from math import ceil

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from depthtrack.viewing.theme import TEXT, Rgb

_BLANK = 0.3
"""Width between words, of the text's size."""


def put_text(
    image: NDArray[np.uint8],
    text: str,
    position: tuple[int, int],
    size: int = 14,
    colour: Rgb = TEXT,
) -> None:
    """Write `text` into `image` (h, w, 3), in place: `position` is the left end of its centre line, `size` in pixels.

    Text that reaches outside the image is cut.
    """
    coverage = _coverage(text, size)
    height, width = coverage.shape
    left, top = position[0], position[1] - height // 2
    x0, y0 = max(left, 0), max(top, 0)
    x1, y1 = min(left + width, image.shape[1]), min(top + height, image.shape[0])
    if x0 >= x1 or y0 >= y1:
        return
    alpha = coverage[y0 - top : y1 - top, x0 - left : x1 - left, None].astype(np.float32) / 255
    window = image[y0:y1, x0:x1]
    window[:] = np.rint(window * (1 - alpha) + np.array(colour, dtype=np.float32) * alpha)


def text_width(text: str, size: int = 14) -> int:
    """Width in pixels of `text` as `put_text` writes it."""
    return _coverage(text, size).shape[1]


@lru_cache(maxsize=512)
def _coverage(text: str, size: int) -> NDArray[np.uint8]:
    """How much of each pixel (h, w) the text covers, 0 to 255; h depends on `size` alone."""
    font = ImageFont.load_default(size)
    # The font's own blank is so thin that words run into one another.
    words, blank = text.split(" "), ceil(_BLANK * size)
    lengths = [font.getlength(word) for word in words]
    width = max(1, round(sum(lengths)) + blank * (len(words) - 1) + 1)
    canvas = Image.new("L", (width, round(1.5 * size)))
    x = 0.0
    for word, length in zip(words, lengths, strict=True):
        ImageDraw.Draw(canvas).text((round(x), canvas.height / 2), word, font=font, fill=255, anchor="lm")
        x += length + blank
    return np.asarray(canvas)
