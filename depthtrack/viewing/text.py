"""Antialiased text on images."""

from functools import lru_cache
from math import ceil

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from depthtrack.viewing.theme import TEXT, Rgb

_BLANK = 0.3
"""Space between words, relative to the text's size."""


def put_text(
    image: NDArray[np.uint8],
    text: str,
    position: tuple[int, int],
    size: int = 14,
    colour: Rgb = TEXT,
) -> None:
    """Draw text into an image (h, w, 3), in place; text outside the image is clipped.

    position: x and y of the left end of the text's centre line, pixels.
    size: pixels.
    """
    coverage = _coverage(text, size)
    height, width = coverage.shape
    left, top = position[0], position[1] - height // 2
    x0, y0 = max(left, 0), max(top, 0)
    x1, y1 = min(left + width, image.shape[1]), min(top + height, image.shape[0])
    if x0 >= x1 or y0 >= y1:
        return
    alpha = coverage[y0 - top : y1 - top, x0 - left : x1 - left, None].astype(np.float32) / 255
    region = image[y0:y1, x0:x1]
    region[:] = np.rint(region * (1 - alpha) + np.array(colour, dtype=np.float32) * alpha)


def text_width(text: str, size: int = 14) -> int:
    """Return the width of a text drawn by `put_text`, pixels."""
    return _coverage(text, size).shape[1]


@lru_cache(maxsize=512)
def _coverage(text: str, size: int) -> NDArray[np.uint8]:
    """Return the coverage of each pixel by a text (h, w), 0 to 255; h depends only on `size`."""
    font = ImageFont.load_default(size)
    # The font's own space is too narrow to separate words.
    words, blank = text.split(" "), ceil(_BLANK * size)
    lengths = [font.getlength(word) for word in words]
    width = max(1, round(sum(lengths)) + blank * (len(words) - 1) + 1)
    canvas = Image.new("L", (width, round(1.5 * size)))
    x = 0.0
    for word, length in zip(words, lengths, strict=True):
        ImageDraw.Draw(canvas).text((round(x), canvas.height / 2), word, font=font, fill=255, anchor="lm")
        x += length + blank
    return np.asarray(canvas)
