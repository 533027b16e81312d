"""Fast encoding of greyscale PNG, of 8 or 16 bits.

libdeflate compresses noisy depth in a quarter of the time of zlib, and to three quarters of the size.
"""

import struct
import sys
import zlib
from collections.abc import Callable
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from depthtrack.types import Image

with suppress(ImportError):
    import deflate

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_HEADER = struct.Struct(">IIBBBBB")
_LEVEL, _SMOOTH_LEVEL = 1, 2
_SMOOTH = 0.1
"""Compressed share of the rows below which the second level is faster."""
_NONE, _UP = 0, 2
"""Filters of rows (PNG specification, third edition, section 9): none suits noise, the row above suits smooth depth."""
_SAMPLE = 32
"""Rows that the filter is chosen on."""

compress: Callable[[bytes, int], bytes | bytearray] = zlib.compress
if "deflate" in sys.modules:
    compress = deflate.zlib_compress


def encode_png(image: Image | NDArray[np.uint16]) -> bytes:
    """Return the PNG of a greyscale image (h, w); equal input gives equal bytes."""
    height, width = image.shape
    big_endian = image.astype(image.dtype.newbyteorder(">"), copy=False)
    rows = np.ascontiguousarray(big_endian).view(np.uint8).reshape(height, -1)
    middle = rows[max(height // 2 - _SAMPLE // 2, 0) :][:_SAMPLE]
    sizes = {kind: len(compress(_filtered(middle, kind), _LEVEL)) for kind in (_NONE, _UP)}
    kind = min(sizes, key=sizes.__getitem__)
    level = _LEVEL if sizes[kind] > _SMOOTH * middle.size else _SMOOTH_LEVEL
    header = _HEADER.pack(width, height, 8 * image.dtype.itemsize, 0, 0, 0, 0)
    pixels = bytes(compress(_filtered(rows, kind), level))
    return _SIGNATURE + b"".join([_chunk(b"IHDR", header), _chunk(b"IDAT", pixels), _chunk(b"IEND", b"")])


def _filtered(rows: NDArray[np.uint8], kind: int) -> bytes:
    """Return bytes (h, w) of an image, each row after the number of its filter."""
    out = np.empty((rows.shape[0], rows.shape[1] + 1), np.uint8)
    out[:, 0] = kind
    if kind == _NONE:
        out[:, 1:] = rows
    else:
        out[0, 1:] = rows[0]
        np.subtract(rows[1:], rows[:-1], out=out[1:, 1:])
    return out.tobytes()


def _chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
