"""Depth images as TIFF: whole millimetres of 16 bits, or 32-bit floats in metres."""

from io import BytesIO
from pathlib import Path

import numpy as np
from PIL import Image as Pictures

from depthtrack.errors import DamagedFrameError, InputError
from depthtrack.files import open_regular, read_bounded
from depthtrack.types import Depth

_MILLIMETRES, _METRES = ("I;16", "I;16L"), "F"
"""Pillow's modes of the two types."""


def read_tiff_size(path: Path) -> tuple[int, int]:
    """Return (width, height) of a TIFF.

    Raises:
        DamagedFrameError: if the file is missing or its header is damaged.
    """
    try:
        with open_regular(path) as file, Pictures.open(file, formats=("TIFF",)) as image:
            return image.size
    except Exception as error:  # Pillow raises many types for damaged files
        raise DamagedFrameError(f"{path} must be a TIFF image with an intact header") from error


def read_tiff_depth(path: Path, shape: tuple[int, int]) -> Depth:
    """Return the depth (h, w), metres, 0 = none.

    Raises:
        DamagedFrameError: if the file is missing or damaged, or has another size or type.
    """
    height, width = shape
    try:
        data = read_bounded(path, 8 * height * width + (1 << 20))
    except InputError as error:
        raise DamagedFrameError(str(error)) from error
    try:
        with Pictures.open(BytesIO(data), formats=("TIFF",)) as image:
            size, mode = image.size, image.mode
            if size == (width, height) and mode in (*_MILLIMETRES, _METRES):
                stored = np.asarray(image)
    except Exception as error:  # Pillow raises many types for damaged files
        raise DamagedFrameError(f"{path} is damaged: it cannot be decoded as TIFF") from error
    if size != (width, height):
        raise DamagedFrameError(f"{path} must have the camera's {width}x{height} pixels, found {size[0]}x{size[1]}")
    if mode not in (*_MILLIMETRES, _METRES):
        raise DamagedFrameError(
            f"{path} must hold depth, one channel of 16-bit whole numbers or 32-bit floats, found mode {mode}: depth as"
            " colours has lost its meaning"
        )
    depth = stored.astype(np.float32) * np.float32(1 if mode == _METRES else 0.001)
    return np.where((depth > 0) & (depth < 100), depth, 0).astype(np.float32, copy=False)
