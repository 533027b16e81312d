"""Decompression of RVL, the run lengths of depth images of ROS (compressedDepth).

- An image is a row of runs: the number of zeros, the number of other pixels, and the change of each of those.
- A change is the difference from the last pixel that is not zero. Its codes alternate in sign: 0, -1, 1, -2, ...
- A number takes nibbles of three bits, the lowest first. The highest bit of a nibble states that more follow.
- Nibbles fill words of 32 bits from the top. Words are little-endian.

Source: A. Wilson, Fast lossless depth image compression, ISS 2017.
"""

import numpy as np
from numpy.typing import NDArray

from depthtrack.errors import InputError
from depthtrack.types import Index

_MOST_BYTES = 3
"""Bytes that a pixel takes at most: a change has 17 bits, in six nibbles."""
_MOST_NIBBLES = 10
"""Nibbles of a number of 30 bits; no image has such runs."""
_SHIFTS = np.arange(28, -1, -4, dtype=np.uint32)


def decompress(data: bytes, pixels: int) -> NDArray[np.uint16]:
    """Return the `pixels` values of an image.

    Raises:
        InputError: if the data ends before, or its runs exceed the image.
    """
    numbers = _numbers(data[: _MOST_BYTES * pixels + 16])
    places, sources = _runs(numbers, pixels)
    changes = numbers[sources]
    values = np.cumsum((changes >> 1) ^ -(changes & 1))
    image = np.zeros(pixels, dtype=np.uint16)
    image[places] = (values & 0xFFFF).astype(np.uint16)
    return image


def _numbers(data: bytes) -> Index:
    """Return the numbers of the data; those of too many nibbles are -1."""
    words = np.frombuffer(data + bytes(-len(data) % 4), dtype="<u4")
    nibbles = ((words[:, None] >> _SHIFTS) & 15).astype(np.int64).ravel()
    ends = np.flatnonzero(nibbles < 8)
    if not len(ends):
        return np.zeros(0, dtype=np.int64)
    starts = np.concatenate([[0], ends[:-1] + 1])
    lengths = ends - starts + 1
    order = np.arange(ends[-1] + 1) - np.repeat(starts, lengths)
    parts = (nibbles[: ends[-1] + 1] & 7) << (3 * np.minimum(order, _MOST_NIBBLES))
    return np.where(lengths > _MOST_NIBBLES, -1, np.add.reduceat(parts, starts))


def _runs(numbers: Index, pixels: int) -> tuple[Index, Index]:
    """Return the places of the pixels that are not zero, and of their changes among the numbers.

    Raises:
        InputError: if the runs do not fill the image.
    """
    listed = numbers.tolist()
    places, sources = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
    pixel = number = 0
    while pixel < pixels:
        if number + 2 > len(listed):
            raise InputError(f"RVL data must hold {pixels:,} pixels, found {pixel:,}")
        zeros, others = listed[number : number + 2]
        if min(zeros, others) < 0 or zeros + others > pixels - pixel or number + 2 + others > len(listed):
            raise InputError("RVL data is damaged")
        if others:
            places.append(np.arange(pixel + zeros, pixel + zeros + others))
            sources.append(np.arange(number + 2, number + 2 + others))
        pixel, number = pixel + zeros + others, number + 2 + others
    return np.concatenate(places), np.concatenate(sources)
