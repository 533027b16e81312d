"""How the kernels keep an image: in stripes of eight columns, each stored from top to bottom.

Sixteen neighbouring floats are then a block of two rows by eight columns: one cache line, one AVX-512 register. The
parts of a hand fill such blocks better than sixteen pixels of a row, and a walk down a stripe is one through memory.
"""

import numpy as np
from numpy.typing import NDArray

from depthtrack.types import Array32

COLUMNS, ROWS = 8, 2
BLOCK = COLUMNS * ROWS
"""Pixels of a block."""
_CACHE_LINE = 64


def stripe_counts(shape: tuple[int, int]) -> tuple[int, int]:
    """Stripes, and blocks in each, that hold an image of (height, width)."""
    return -(-shape[1] // COLUMNS), -(-shape[0] // ROWS)


def new_stripes(shape: tuple[int, int]) -> Array32:
    """Zeros (stripes * blocks * BLOCK,) for an image of (height, width), aligned to cache lines."""
    tiles, blocks = stripe_counts(shape)
    size = tiles * blocks * BLOCK
    memory = np.zeros(size + _CACHE_LINE // 4, np.float32)
    start = -memory.ctypes.data % _CACHE_LINE // 4
    return memory[start : start + size]


def write_stripes(image: NDArray[np.generic], beyond: float, stored: Array32) -> None:
    """Store an image (h, w); what the last blocks hold beyond it becomes `beyond`."""
    (height, width), (tiles, blocks) = image.shape, stripe_counts(image.shape)
    rows = np.full((blocks * ROWS, tiles * COLUMNS), beyond, np.float32)
    rows[:height, :width] = image
    stored.reshape(tiles, blocks * ROWS, COLUMNS)[:] = rows.reshape(-1, tiles, COLUMNS).swapaxes(0, 1)


def read_stripes(stored: Array32, shape: tuple[int, int]) -> Array32:
    """The image (h, w) of that shape."""
    tiles, blocks = stripe_counts(shape)
    rows = stored.reshape(tiles, blocks * ROWS, COLUMNS).swapaxes(0, 1).reshape(-1, tiles * COLUMNS)
    return rows[: shape[0], : shape[1]]
