"""Counter-based random numbers keyed by seed, frame and purpose.

Frames are independent of the order and of the threads that synthesise them.
"""

from enum import IntEnum
from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

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
    return _quantiles(1 << 16).take(rng.integers(0, 1 << 16, shape, dtype=np.uint16))


def coarse_normal_noise(rng: np.random.Generator, shape: tuple[int, ...]) -> Array32:
    """Return standard normal values of `shape` from 256 quantiles, at most 2.9 deviations.

    It is 3 times faster than `normal_noise`, and suits values that are rounded to few levels.
    """
    return np.asarray(cv2.LUT(_drawn(rng, shape), _quantiles(1 << 8)), dtype=np.float32)


def rounded_normal_noise(rng: np.random.Generator, shape: tuple[int, ...], spread: float) -> NDArray[np.int16]:
    """Return `coarse_normal_noise` of a standard deviation, rounded to whole numbers."""
    values = np.rint(spread * _quantiles(1 << 8)).astype(np.int16)
    return np.asarray(cv2.LUT(_drawn(rng, shape), values), dtype=np.int16)


def _drawn(rng: np.random.Generator, shape: tuple[int, ...]) -> NDArray[np.uint8]:
    return rng.integers(0, 1 << 8, shape, dtype=np.uint8)


@cache
def _quantiles(count: int) -> Array32:
    values = ndtri((np.arange(count) + 0.5) / count)
    return np.asarray(values / values.std(), dtype=np.float32)
