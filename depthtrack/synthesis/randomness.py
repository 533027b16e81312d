"""Counter-based random numbers keyed by seed, frame and purpose.

Frames are independent of the order and of the threads that synthesise them.
"""

import math
from enum import IntEnum
from functools import cache
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from depthtrack.compilation import compiled
from depthtrack.types import Array32


class Stream(IntEnum):
    """Purposes of random numbers; streams of one seed and frame do not overlap."""

    POSTURES = 1
    WANDERING = 2
    ROOM = 3
    SKIN = 4
    DEPTH = 5
    COLOUR = 6
    FLIPS = 7
    ARM = 8
    LIGHT = 9
    DEPTH_NOISE = 10
    KEYPOINTS = 11
    HELD = 12
    SUBJECT = 13
    DROPOUTS = 14
    GHOSTS = 15
    MARKERS = 16
    SHUFFLE = 17
    RIGID_BODY = 18
    RIGID_MOTION = 19


def generator(seed: int, frame: int, stream: Stream) -> np.random.Generator:
    """Return a Philox4x64 generator: key from seed and frame, counter from the stream.

    Source: Salmon et al., "Parallel random numbers: as easy as 1, 2, 3", 2011.
    """
    key = np.array([seed, frame], dtype=np.uint64)
    # The low words count the numbers drawn; the highest separates the streams by 2^192.
    counter = np.array([0, 0, 0, int(stream)], dtype=np.uint64)
    return np.random.Generator(np.random.Philox(key=key, counter=counter))


def normal_noise(rng: np.random.Generator, shape: tuple[int, ...]) -> Array32:
    """Return standard normal values of `shape` from 65536 quantiles.

    It is 3 times faster than `Generator.standard_normal`.
    """
    return _quantiles(1 << 16).take(_drawn(rng, shape, np.dtype(np.uint16)))


def coarse_normal_noise(rng: np.random.Generator, shape: tuple[int, ...]) -> tuple[NDArray[np.uint8], Array32]:
    """Return places of `shape` in a table of standard normal quantiles, and the table.

    The table has 256 rows, of at most 2.9 deviations. It is 3 times faster than `normal_noise`, and suits values that
    are rounded to few levels.
    """
    return _drawn(rng, shape, np.dtype(np.uint8)), _quantiles(1 << 8)


def uniform_words(rng: np.random.Generator, shape: tuple[int, ...]) -> NDArray[np.uint32]:
    """Return words of `shape` from which `uniform_of` makes uniform numbers.

    They are those of `Generator.random` in single precision.
    """
    return _drawn(rng, shape, np.dtype(np.uint32))


@compiled(nogil=True)
def uniform_of(word: int) -> np.float32:
    """Return a uniform number below 1."""
    return np.float32(word >> 8) * np.float32(2.0**-24)


def rounded_normal_noise(rng: np.random.Generator, shape: tuple[int, ...], spread: float) -> NDArray[np.int16]:
    """Return normal values of 256 quantiles and a standard deviation, rounded to whole numbers."""
    values = np.rint(spread * _quantiles(1 << 8)).astype(np.int16)
    return np.asarray(cv2.LUT(_drawn(rng, shape, np.dtype(np.uint8)), values), dtype=np.int16)


def _drawn(rng: np.random.Generator, shape: tuple[int, ...], kind: np.dtype[Any]) -> NDArray[Any]:
    """Return uniform whole numbers of 8 to 32 bits, in half the time of `Generator.integers`."""
    words, rest = divmod(math.prod(shape) * kind.itemsize, 8)
    if rest or rng.bit_generator.state["has_uint32"]:
        return rng.integers(0, 1 << 8 * kind.itemsize, shape, dtype=kind)
    raw = np.asarray(rng.bit_generator.random_raw(words), dtype="<u8")
    return raw.view(kind.newbyteorder("<")).astype(kind, copy=False).reshape(shape)


@cache
def _quantiles(count: int) -> Array32:
    values = ndtri((np.arange(count) + 0.5) / count)
    return np.asarray(values / values.std(), dtype=np.float32)
