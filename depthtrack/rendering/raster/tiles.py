"""Tiled memory layout of images: tiles of 8 x 2 pixels, one column of tiles after the other.

A tile is sixteen adjacent floats: one cache line and one AVX-512 register. The parts of a hand fill such tiles better
than sixteen pixels of a row. Moving down a column of tiles reads memory in order.
"""

import numpy as np
from numpy.typing import NDArray

from depthtrack.compilation import compiled
from depthtrack.types import Array32, Depth, Index, Mask

TILE_WIDTH, TILE_HEIGHT = 8, 2
"""Pixels."""
TILE_PIXELS = TILE_WIDTH * TILE_HEIGHT
_CACHE_LINE = 64


def tile_counts(shape: tuple[int, int]) -> tuple[int, int]:
    """Return the columns and rows of tiles that hold an image of `shape` (height, width)."""
    return -(-shape[1] // TILE_WIDTH), -(-shape[0] // TILE_HEIGHT)


def new_tiled_image(shape: tuple[int, int]) -> Array32:
    """Return zeros (columns * rows * TILE_PIXELS,) for an image of `shape` (height, width)."""
    columns, rows = tile_counts(shape)
    return new_tiles(columns * rows)


def new_tiles(count: int) -> Array32:
    """Return zeros (count * TILE_PIXELS,), aligned to cache lines."""
    size = count * TILE_PIXELS
    memory = np.zeros(size + _CACHE_LINE // 4, np.float32)
    start = -memory.ctypes.data % _CACHE_LINE // 4
    return memory[start : start + size]


def write_tiled(image: NDArray[np.generic], beyond: float, tiled: Array32) -> None:
    """Write an image (h, w) to `tiled`; pixels outside the image become `beyond`."""
    write_tiles(np.ascontiguousarray(image), np.float32(beyond), tiled)


def read_depth(tiled: Array32, shape: tuple[int, int]) -> Depth:
    """Return the depth (h, w) of the inverse depth that `write_tiled` stored; 0 where it is 0."""
    depth = np.empty(shape, np.float32)
    invert_tiles(tiled, depth)
    return depth


@compiled(nogil=True)
def write_tiles(image: NDArray[np.generic], beyond: np.float32, tiled: Array32) -> None:
    """Write an image (h, w) to `tiled`; see `write_tiled`."""
    height, width = image.shape
    rows, whole = -(-height // TILE_HEIGHT) * TILE_HEIGHT, width // TILE_WIDTH * TILE_WIDTH
    for v in range(height):
        for left in range(0, whole, TILE_WIDTH):
            for i in range(TILE_WIDTH):
                tiled[left * rows + v * TILE_WIDTH + i] = np.float32(image[v, left + i])
        if whole < width:
            for i in range(TILE_WIDTH):
                inside = whole + i < width
                tiled[whole * rows + v * TILE_WIDTH + i] = np.float32(image[v, whole + i]) if inside else beyond
    for v in range(height, rows):
        for left in range(0, width, TILE_WIDTH):
            for i in range(TILE_WIDTH):
                tiled[left * rows + v * TILE_WIDTH + i] = beyond


@compiled(nogil=True)
def write_labels(silhouette: Mask, depth: Depth, labels: Index) -> None:
    """Write two bits per pixel of the images (h, w) to `labels`, an element a tile.

    Bit n of a label is set if pixel n of the tile is on the silhouette, bit TILE_PIXELS + n if its depth is missing.
    """
    height, width = silhouette.shape
    rows, columns = -(-height // TILE_HEIGHT), -(-width // TILE_WIDTH)
    for row in range(rows):
        for column in range(columns):
            label, left = np.int64(0), TILE_WIDTH * column
            for j in range(min(TILE_HEIGHT, height - TILE_HEIGHT * row)):
                v = TILE_HEIGHT * row + j
                on, missing = np.int64(0), np.int64(0)
                if left + TILE_WIDTH <= width:
                    for i in range(TILE_WIDTH):
                        on |= np.int64(silhouette[v, left + i]) << i
                        missing |= np.int64(depth[v, left + i] == 0) << i
                else:
                    for i in range(width - left):
                        on |= np.int64(silhouette[v, left + i]) << i
                        missing |= np.int64(depth[v, left + i] == 0) << i
                label |= (on | missing << TILE_PIXELS) << (j * TILE_WIDTH)
            labels[column * rows + row] = label


@compiled(nogil=True)
def invert_tiles(tiled: Array32, image: Array32) -> None:
    """Write the inverse of what `write_tiled` stored to an image (h, w); see `read_depth`."""
    height, width = image.shape
    rows, whole = -(-height // TILE_HEIGHT) * TILE_HEIGHT, width // TILE_WIDTH * TILE_WIDTH
    for v in range(height):
        for left in range(0, whole, TILE_WIDTH):
            for i in range(TILE_WIDTH):
                inverse = tiled[left * rows + v * TILE_WIDTH + i]
                image[v, left + i] = np.float32(1) / inverse if inverse > 0 else np.float32(0)
        for i in range(width - whole):
            inverse = tiled[whole * rows + v * TILE_WIDTH + i]
            image[v, whole + i] = np.float32(1) / inverse if inverse > 0 else np.float32(0)
