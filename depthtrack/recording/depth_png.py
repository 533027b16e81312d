"""Fast decoding of common depth images: greyscale PNG of 16 bits without interlacing.

libdeflate inflates such an image in less than half the time of zlib. A kernel reverses the filters of its rows (PNG
specification, third edition, section 9). OpenCV decodes all other images.
"""

import struct
import sys
import zlib
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from depthtrack.compilation import compiled

try:
    import deflate
except ImportError:
    _ERRORS: tuple[type[Exception], ...] = (zlib.error, ValueError)
else:
    _ERRORS = (zlib.error, ValueError, deflate.DeflateError)

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_HEADER = struct.Struct(">IIBBBBB")
_CHUNK = struct.Struct(">I4s")
_WITHOUT_EFFECT = (b"tEXt", b"zTXt", b"iTXt", b"tIME", b"pHYs")
"""Chunks that change no pixel."""


def decode_depth_png(data: bytes) -> NDArray[np.uint16] | None:
    """Return the pixels (h, w) of a PNG, or None if it is damaged or of another kind.

    data: a file whose size and checksums were verified.
    """
    chunks = dict[bytes, list[bytes]]()
    for kind, content in _chunks(data):
        chunks.setdefault(kind, []).append(content)
    if {b"IHDR", b"IDAT", b"IEND"} ^ set(chunks) - set(_WITHOUT_EFFECT) or len(chunks[b"IHDR"][0]) != _HEADER.size:
        return None
    width, height, *properties = _HEADER.unpack(chunks[b"IHDR"][0])
    rows = None if properties != [16, 0, 0, 0, 0] else _inflated(b"".join(chunks[b"IDAT"]), height * (2 * width + 1))
    if rows is None:
        return None
    pixels = np.empty((height, width), np.uint16)
    return pixels if unfilter_rows(np.frombuffer(rows, np.uint8), pixels) else None


def _chunks(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Yield type and content of the chunks of a PNG; nothing after one that is cut short."""
    at = len(_SIGNATURE)
    while data.startswith(_SIGNATURE) and at + _CHUNK.size <= len(data):
        size, kind = _CHUNK.unpack_from(data, at)
        begin = at + _CHUNK.size
        at = begin + size + 4
        if at > len(data):
            return
        yield kind, data[begin : begin + size]


def _inflated(data: bytes, size: int) -> bytes | bytearray | None:
    """Return `size` inflated bytes, or None if the data hold another number or are damaged."""
    try:
        found = inflate(data, size)
    except _ERRORS:
        return None
    return found if len(found) == size else None


def inflate_by_zlib(data: bytes, size: int) -> bytes:
    """Return the inflated bytes, at most one more than `size`; none if the data end too early.

    Raises:
        zlib.error: if the data are damaged.
    """
    inflater = zlib.decompressobj()
    found = inflater.decompress(data, size + 1)
    return found if inflater.eof else b""


inflate: Callable[[bytes, int], bytes | bytearray] = inflate_by_zlib
if "deflate" in sys.modules:
    inflate = deflate.zlib_decompress


@compiled(nogil=True)
def unfilter_rows(rows: NDArray[np.uint8], pixels: NDArray[np.uint16]) -> bool:
    """Write the pixels (h, w) of filtered rows; return whether all filters are known.

    rows: (h (2 w + 1),) the filter of each row and its bytes, the high byte of each pixel first.
    """
    height, width = pixels.shape
    count = 2 * width
    above, here = np.zeros(count, np.uint8), np.empty(count, np.uint8)
    for r in range(height):
        begin = r * (count + 1)
        row = rows[begin + 1 : begin + 1 + count]
        if not _unfilter(rows[begin], row, above, here):
            return False
        for i in range(width):
            pixels[r, i] = (np.uint16(here[2 * i]) << np.uint16(8)) | np.uint16(here[2 * i + 1])
        above, here = here, above
    return True


@compiled(nogil=True)
def _unfilter(kind: int, row: NDArray[np.uint8], above: NDArray[np.uint8], here: NDArray[np.uint8]) -> bool:
    """Write the bytes of one row from those of the row above it.

    Bytes of neighbouring pixels are two apart.
    """
    count = len(row)
    if kind == 0:
        for i in range(count):
            here[i] = row[i]
    elif kind == 1:
        for byte in range(2):
            left = np.uint8(0)
            for i in range(byte, count, 2):
                left = np.uint8(row[i] + left)
                here[i] = left
    elif kind == 2:
        for i in range(count):
            here[i] = row[i] + above[i]
    elif kind == 3:
        high = low = 0
        for i in range(0, count, 2):
            high = (row[i] + ((high + above[i]) >> 1)) & 255
            low = (row[i + 1] + ((low + above[i + 1]) >> 1)) & 255
            here[i], here[i + 1] = high, low
    elif kind == 4:
        high = low = high_corner = low_corner = 0
        for i in range(0, count, 2):
            high_up, low_up = int(above[i]), int(above[i + 1])
            high = (row[i] + _paeth(high, high_up, high_corner)) & 255
            low = (row[i + 1] + _paeth(low, low_up, low_corner)) & 255
            high_corner, low_corner = high_up, low_up
            here[i], here[i + 1] = high, low
    else:
        return False
    return True


@compiled(nogil=True)
def _paeth(left: int, up: int, corner: int) -> int:
    """Return the neighbour closest to left + up - corner."""
    by_left, by_up = up - corner, left - corner
    by_corner = abs(by_left + by_up)
    by_left, by_up = abs(by_left), abs(by_up)
    if by_left <= by_up and by_left <= by_corner:
        return left
    return up if by_up <= by_corner else corner
