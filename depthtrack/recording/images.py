"""The images of a sequence folder, one at a time: PNG and JPEG, checked before anything is decoded.

A header may claim any size, so the claim is held to the camera's size before the decoder may reserve memory, and a
PNG's checksums are verified so that damaged depth is an error and never a slightly wrong image. JPEG has no checksum:
there a missing end is noticed, a changed byte may not be.
"""

import struct
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from depthtrack.errors import DamagedFrameError
from depthtrack.types import Image, Mask

# Level 1 is the knee of the curve: 2 % of the raw size on clean depth and a third on noisy, at 4-8 ms for 640x480.
_PNG_SETTINGS = (cv2.IMWRITE_PNG_COMPRESSION, 1, cv2.IMWRITE_PNG_STRATEGY, cv2.IMWRITE_PNG_STRATEGY_DEFAULT)
_JPEG_SETTINGS = (cv2.IMWRITE_JPEG_QUALITY, 95)
_PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_JPEG_SIGNATURE = b"\xff\xd8\xff"
# Start-of-frame markers of JPEG, which carry the size: C0..CF without DHT (C4), JPG (C8) and DAC (CC).
_JPEG_FRAME_MARKERS = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
_JPEG_SCAN = 0xDA


@dataclass(frozen=True)
class ImageHeader:
    """What an image file says of itself: sides in pixels, bits and number of channels."""

    width: int
    height: int
    bits: int
    channels: int


def read_depth(path: Path, shape: tuple[int, int]) -> NDArray[np.uint16]:
    """Stored depth units (h, w) of a 16-bit greyscale PNG. Raises DamagedFrameError."""
    data, header = _read(path, shape)
    if not data.startswith(_PNG_SIGNATURE):
        raise DamagedFrameError(f"{path} must be a 16-bit PNG, found a JPEG, which cannot hold depth")
    if header.bits != 16 or header.channels != 1:
        raise DamagedFrameError(
            f"{path} must be a 16-bit PNG with one channel, found {header.bits} bits and {header.channels} channel(s):"
            " save the depth again without converting it to a picture"
        )
    image = _decode(path, data, cv2.IMREAD_UNCHANGED)
    if image.dtype != np.uint16 or image.shape != shape:
        raise DamagedFrameError(f"{path} must decode to 16-bit depth {shape}, found {image.dtype} {image.shape}")
    return image.astype(np.uint16, copy=False)


def read_colour(path: Path, shape: tuple[int, int]) -> Image:
    """RGB (h, w, 3) of a PNG or JPEG. Raises DamagedFrameError."""
    data, _ = _read(path, shape)
    image = _decode(path, data, cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    if image.shape != (*shape, 3):
        raise DamagedFrameError(f"{path} must decode to 8-bit colour {shape}, found {image.dtype} {image.shape}")
    return cv2.cvtColor(image, cv2.COLOR_BGR2RGB).astype(np.uint8, copy=False)


def read_mask(path: Path, shape: tuple[int, int]) -> Mask:
    """(h, w), true where the PNG or JPEG is at least half white. Raises DamagedFrameError."""
    data, _ = _read(path, shape)
    return np.asarray(_decode(path, data, cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION) >= 128)


def read_header(path: Path) -> ImageHeader:
    """Size and depth of a PNG or JPEG from its first 64 KiB. Raises DamagedFrameError."""
    try:
        with path.open("rb") as file:
            return _header(path, file.read(1 << 16))
    except OSError as error:
        raise DamagedFrameError(f"{path} cannot be read: {error.strerror}") from error


def write_png(path: Path, image: Image | NDArray[np.uint16]) -> None:
    """Write (h, w) or RGB (h, w, 3); the same input gives the same bytes."""
    _write(path, ".png", image, _PNG_SETTINGS)


def write_jpeg(path: Path, colour: Image) -> None:
    """Write RGB (h, w, 3) at quality 95; the same input gives the same bytes."""
    _write(path, ".jpg", colour, _JPEG_SETTINGS)


def _write(path: Path, suffix: str, image: Image | NDArray[np.uint16], settings: tuple[int, ...]) -> None:
    encoded = cv2.imencode(suffix, cv2.cvtColor(image, cv2.COLOR_RGB2BGR) if image.ndim == 3 else image, settings)[1]
    path.write_bytes(encoded.tobytes())


def _read(path: Path, shape: tuple[int, int]) -> tuple[bytes, ImageHeader]:
    """The whole file, sound and of the expected size, and its header."""
    height, width = shape
    # Eight bytes a pixel is more than any image here takes uncompressed; the rest is room for metadata.
    largest = 8 * height * width + (1 << 20)
    try:
        if not path.is_file():
            raise DamagedFrameError(f"{path} is missing")
        if path.stat().st_size > largest:
            raise DamagedFrameError(f"{path} is larger than any image of {width}x{height} pixels can be")
        data = path.read_bytes()
    except OSError as error:
        raise DamagedFrameError(f"{path} cannot be read: {error.strerror}") from error
    header = _header(path, data)
    if (header.height, header.width) != shape:
        raise DamagedFrameError(
            f"{path} must be {width}x{height} pixels as the camera says, found {header.width}x{header.height}"
        )
    (_check_png if data.startswith(_PNG_SIGNATURE) else _check_jpeg)(path, data)
    return data, header


def _decode(path: Path, data: bytes, flags: int) -> NDArray[np.integer[Any] | np.floating[Any]]:
    try:
        image = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), flags)
    except cv2.error:
        image = None
    if image is None:
        raise DamagedFrameError(f"{path} is damaged: its pixels cannot be decoded")
    return image


def _header(path: Path, data: bytes) -> ImageHeader:
    if data.startswith(_PNG_SIGNATURE) and len(data) >= 33 and data[12:16] == b"IHDR":
        width, height, bits, colour_type = struct.unpack_from(">IIBB", data, 16)
        return ImageHeader(width, height, bits, {0: 1, 2: 3, 3: 3, 4: 2, 6: 4}.get(colour_type, 0))
    if data.startswith(_JPEG_SIGNATURE):
        for marker, position in _jpeg_segments(data):
            if marker in _JPEG_FRAME_MARKERS and position + 8 <= len(data):
                bits, height, width, channels = struct.unpack_from(">BHHB", data, position + 2)
                return ImageHeader(width, height, bits, channels)
    raise DamagedFrameError(f"{path} must be a PNG or JPEG image, found {_describe(data)}")


def _describe(data: bytes) -> str:
    if not data:
        return "an empty file"
    if data.startswith((_PNG_SIGNATURE, _JPEG_SIGNATURE)):
        return "one whose header is cut off"
    return f"a file that begins with {data[:4]!r}"


def _check_png(path: Path, data: bytes) -> None:
    """Walk the chunks (PNG specification, sec. 5) to the end mark and verify each checksum."""
    position = len(_PNG_SIGNATURE)
    while position + 12 <= len(data):
        length, kind = struct.unpack_from(">I4s", data, position)
        end = position + 12 + length
        if end > len(data):
            break
        if zlib.crc32(data[position + 4 : end - 4]) != struct.unpack_from(">I", data, end - 4)[0]:
            raise DamagedFrameError(f"{path} is damaged: its checksum is wrong from byte {position} on")
        if kind == b"IEND":
            return
        position = end
    raise DamagedFrameError(f"{path} is truncated: it ends after {len(data)} bytes, in the middle of the image")


def _check_jpeg(path: Path, data: bytes) -> None:
    """The end mark must follow the first scan; compressed pixels never contain it (ITU T.81, sec. B.1.1.5)."""
    scans = [position for marker, position in _jpeg_segments(data) if marker == _JPEG_SCAN]
    if not scans or data.rfind(b"\xff\xd9") < scans[0]:
        raise DamagedFrameError(f"{path} is truncated: it ends after {len(data)} bytes, in the middle of the image")


def _jpeg_segments(data: bytes) -> list[tuple[int, int]]:
    """(marker, position of its length field) of the segments up to the first scan.

    Stops at anything else than a segment with a length, so that no header can be hidden from this check.
    """
    segments, position = [], 2
    while position + 4 <= len(data) and data[position] == 0xFF:
        marker = data[position + 1]
        if marker == 0xFF:  # fill bytes may stand before a marker
            position += 1
            continue
        if marker < 0xC0 or 0xD0 <= marker <= 0xD9:
            break
        segments.append((marker, position + 2))
        if marker == _JPEG_SCAN:
            break
        position += 2 + struct.unpack_from(">H", data, position + 2)[0]
    return segments
