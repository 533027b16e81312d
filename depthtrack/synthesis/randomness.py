"""Random numbers keyed by seed, frame and purpose, so that any frame can be made by itself, on any thread."""

from enum import IntEnum

import numpy as np


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
