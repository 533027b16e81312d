"""Tiled memory layout of images: tiles of 8 x 2 pixels, one column of tiles after the other.

A tile is sixteen adjacent floats: one cache line and one AVX-512 register. The parts of a hand fill such tiles better
than sixteen pixels of a row. Moving down a column of tiles reads memory in order.
"""

import numpy as np
from numpy.typing import NDArray

from depthtrack.types import Array32

TILE_WIDTH, TILE_HEIGHT = 8, 2
"""Pixels."""
TILE_PIXELS = TILE_WIDTH * TILE_HEIGHT
_CACHE_LINE = 64


def tile_counts(shape: tuple[int, int]) -> tuple[int, int]:
    """Return the columns and rows of tiles that hold an image of `shape` (height, width)."""
    return -(-shape[1] // TILE_WIDTH), -(-shape[0] // TILE_HEIGHT)


def new_tiled_image(shape: tuple[int, int]) -> Array32:
    """Return zeros (columns * rows * TILE_PIXELS,) for an image of `shape` (height, width).

    The memory is aligned to cache lines.
    """
    columns, rows = tile_counts(shape)
    size = columns * rows * TILE_PIXELS
    memory = np.zeros(size + _CACHE_LINE // 4, np.float32)
    start = -memory.ctypes.data % _CACHE_LINE // 4
    return memory[start : start + size]


def write_tiled(image: NDArray[np.generic], beyond: float, tiled: Array32) -> None:
    """Write an image (h, w) to `tiled`; pixels outside the image become `beyond`."""
    (height, width), (columns, rows) = image.shape, tile_counts(image.shape)
    padded = np.full((rows * TILE_HEIGHT, columns * TILE_WIDTH), beyond, np.float32)
    padded[:height, :width] = image
    tiled.reshape(columns, rows * TILE_HEIGHT, TILE_WIDTH)[:] = padded.reshape(-1, columns, TILE_WIDTH).swapaxes(0, 1)


def read_tiled(tiled: Array32, shape: tuple[int, int]) -> Array32:
    """Return the image (h, w) of `shape` that `write_tiled` stored."""
    columns, rows = tile_counts(shape)
    padded = tiled.reshape(columns, rows * TILE_HEIGHT, TILE_WIDTH).swapaxes(0, 1).reshape(-1, columns * TILE_WIDTH)
    return padded[: shape[0], : shape[1]]
