"""Random numbers keyed by seed, frame and purpose, so that any frame can be made by itself, on any thread."""

from enum import IntEnum
from functools import cache

import cv2
import numpy as np
from scipy.special import ndtri

from depthtrack.types import Array32


class Stream(IntEnum):
    """What the numbers are for: streams of one seed and frame do not overlap."""

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


def generator(seed: int, frame: int, stream: Stream) -> np.random.Generator:
    """A counter-based generator (Philox4x64; Salmon et al. 2011): key from seed and frame, counter from the stream."""
    key = np.array([seed, frame], dtype=np.uint64)
    # The low words count the numbers drawn; the highest keeps the streams 2^192 apart.
    counter = np.array([0, 0, 0, int(stream)], dtype=np.uint64)
    return np.random.Generator(np.random.Philox(key=key, counter=counter))


def normal_noise(rng: np.random.Generator, shape: tuple[int, ...]) -> Array32:
    """Standard normal numbers for images, three times as fast as the generator's own: 65536 equally likely values."""
    return _quantiles(1 << 16).take(rng.integers(0, 1 << 16, shape, dtype=np.uint16))


def coarse_normal_noise(rng: np.random.Generator, shape: tuple[int, ...]) -> Array32:
    """The same of 256 values, up to 2.9 deviations, for what is rounded to a few levels; three times as fast again."""
    drawn = rng.integers(0, 1 << 8, shape, dtype=np.uint8)
    return np.asarray(cv2.LUT(drawn, _quantiles(1 << 8)), dtype=np.float32)


@cache
def _quantiles(count: int) -> Array32:
    values = ndtri((np.arange(count) + 0.5) / count)
    return np.asarray(values / values.std(), dtype=np.float32)
