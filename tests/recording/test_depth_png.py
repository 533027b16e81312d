"""Decoding of depth images by rows, against OpenCV."""

import struct
import zlib

import cv2
import numpy as np
import pytest

from depthtrack.recording import depth_png
from depthtrack.recording.depth_png import decode_depth_png


def _chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))


def _png(rows: bytes, width: int, height: int, *more: bytes, depth: int = 16, parts: int = 1) -> bytes:
    """Return a greyscale PNG of filtered rows."""
    packed = zlib.compress(rows)
    cuts = [packed[i * len(packed) // parts : (i + 1) * len(packed) // parts] for i in range(parts)]
    header = _chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, depth, 0, 0, 0, 0))
    return b"".join([b"\x89PNG\r\n\x1a\n", header, *more, *(_chunk(b"IDAT", c) for c in cuts), _chunk(b"IEND", b"")])


def _rows(filters: list[int], width: int) -> bytes:
    """Return random bytes behind each filter."""
    random = np.random.default_rng(len(filters))
    return b"".join(bytes([kind]) + random.bytes(2 * width) for kind in filters)


def _expected(data: bytes) -> np.ndarray:
    return np.asarray(cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED))


@pytest.mark.parametrize("library", ["deflate", "zlib"])
@pytest.mark.parametrize("filters", [[0] * 5, [1] * 5, [2] * 5, [3] * 5, [4] * 5, [4, 3, 2, 1, 0] * 40])
@pytest.mark.parametrize("width", [1, 7, 64])
def test_all_filters_give_the_pixels_of_opencv(
    library: str, filters: list[int], width: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    if library == "zlib":
        monkeypatch.setattr(depth_png, "inflate", depth_png.inflate_by_zlib)
    text = _chunk(b"tEXt", b"Comment\0depth")
    data = _png(_rows(filters, width), width, len(filters), text, parts=3)
    np.testing.assert_array_equal(decode_depth_png(data), _expected(data))


@pytest.mark.parametrize("level", [0, 1, 9])
def test_images_of_opencv_are_decoded(level: int) -> None:
    image = np.random.default_rng(level).integers(0, 1 << 16, (48, 65)).astype(np.uint16)
    image[10:30] = np.arange(65) + 500
    data = cv2.imencode(".png", image, [cv2.IMWRITE_PNG_COMPRESSION, level])[1].tobytes()
    np.testing.assert_array_equal(decode_depth_png(data), image)


def test_other_images_are_left_to_opencv() -> None:
    rows = _rows([1, 2, 3], 8)
    sound = _png(rows, 8, 3)
    others = [
        _png(rows, 8, 4),  # too few rows
        _png(rows, 8, 2),  # too many
        _png(_rows([1, 2, 5], 8), 8, 3),  # an unknown filter
        _png(rows, 16, 3, depth=8),
        _png(rows, 8, 3, _chunk(b"tRNS", b"\0\1")),
        sound[:-30],
        sound.replace(b"IEND", b"IENE"),
        b"",
        b"\xff\xd8\xff",
    ]
    assert decode_depth_png(sound) is not None
    assert [decode_depth_png(data) for data in others] == [None] * len(others)


@pytest.mark.parametrize("library", ["deflate", "zlib"])
def test_damaged_bytes_give_no_pixels(library: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if library == "zlib":
        monkeypatch.setattr(depth_png, "inflate", depth_png.inflate_by_zlib)
    rows = _rows([0] * 16, 32)
    packed = bytearray(zlib.compress(rows))
    header = _chunk(b"IHDR", struct.pack(">IIBBBBB", 32, 16, 16, 0, 0, 0, 0))
    for at in range(2, len(packed), 97):
        damaged = packed.copy()
        damaged[at] ^= 0x55
        data = b"\x89PNG\r\n\x1a\n" + header + _chunk(b"IDAT", bytes(damaged)) + _chunk(b"IEND", b"")
        assert decode_depth_png(data) is None
