"""Reading and writing of a sequence folder's PNG and JPEG images, checked before decoding.

Pillow reads the header, so the claimed size is compared with the camera's before a decoder reserves memory. Pillow
also verifies the checksums of a PNG. JPEG has no checksum: a missing end is an error, a changed byte may not be.
`depth_png` decodes depth, `png_encoding` encodes greyscale PNG, and OpenCV does everything else.
"""

from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image as Pictures
from PIL import UnidentifiedImageError

from depthtrack.errors import DamagedFrameError, InputError
from depthtrack.files import open_regular, read_bounded
from depthtrack.recording.depth_png import decode_depth_png
from depthtrack.recording.png_encoding import encode_png
from depthtrack.types import Image, Mask

# Of colour; `png_encoding` writes greyscale.
_PNG_SETTINGS = (cv2.IMWRITE_PNG_COMPRESSION, 1, cv2.IMWRITE_PNG_STRATEGY, cv2.IMWRITE_PNG_STRATEGY_DEFAULT)
_JPEG_SETTINGS = (cv2.IMWRITE_JPEG_QUALITY, 95)
_PNG_END = b"\0\0\0\0IEND\xaeB`\x82"
"""The last chunk of a PNG with its checksum, which Pillow does not verify."""
_JPEG_END = b"\xff\xd9"
_DEPTH_MODES = ("I;16", "I")
"""Pillow's modes of a PNG with one channel of 16 bits; versions before 11 use the second."""
_HEADER_BYTES = 1 << 16
_JPEG_REMEDY = "it changes depths, so save the depth again as PNG"
_CHANNELS_REMEDY = (
    "colours of depth have lost it, so export the depth itself; unpack depth in channels to one of 16 bits"
)
_DEPTH_REMEDIES = {"L": "8 bits have lost the depth, so export the depth itself, not its picture"}
"""What to do by Pillow's mode of a PNG."""
_OTHER_FORMATS = {b"II*\0": "TIFF", b"MM\0*": "TIFF", b"v/1\x01": "EXR", b"\x93NUM": "array of numpy"}
"""Formats of depth that are not read, by their first bytes."""
_CONVERSION = "save 16-bit PNG, for metres  cv2.imwrite('1.png', (1000 * depth).round().astype('uint16'))"


@dataclass(frozen=True)
class _Header:
    """Pillow's format and mode, sides in pixels, and the offset of the pixels, bytes."""

    image_format: str
    mode: str
    width: int
    height: int
    pixels_begin: int


def read_depth(path: Path, shape: tuple[int, int]) -> NDArray[np.uint16]:
    """Return the stored depth units (h, w) of a 16-bit greyscale PNG.

    Raises:
        DamagedFrameError: if the file is missing or damaged, or has another size or type.
    """
    return decode_depth(path, _read_bytes(path, shape), shape)


def decode_depth(where: Path | str, data: bytes, shape: tuple[int, int]) -> NDArray[np.uint16]:
    """Return the stored depth units (h, w) of the bytes of a 16-bit PNG, whose name is `where`.

    Raises:
        DamagedFrameError: if they are damaged, or the image has another size or type.
    """
    header = _check(where, data, shape)
    if header.image_format != "PNG" or header.mode not in _DEPTH_MODES:
        lossy = header.image_format != "PNG"
        raise DamagedFrameError(
            f"{where} must be a 16-bit PNG with one channel, found a {header.image_format} of mode {header.mode}:"
            f" {_JPEG_REMEDY if lossy else _DEPTH_REMEDIES.get(header.mode, _CHANNELS_REMEDY)}"
        )
    if (pixels := decode_depth_png(data)) is not None:
        return pixels
    image = _decode(where, data, cv2.IMREAD_UNCHANGED)
    if image.dtype != np.uint16 or image.shape != shape:
        raise DamagedFrameError(f"{where} must decode to 16-bit depth {shape}, found {image.dtype} {image.shape}")
    return image.astype(np.uint16, copy=False)


def read_colour(path: Path, shape: tuple[int, int]) -> Image:
    """Return the RGB pixels (h, w, 3) of a PNG or JPEG.

    Raises:
        DamagedFrameError: if the file is missing or damaged, or has another size.
    """
    return decode_colour(path, _read_bytes(path, shape), shape)


def decode_colour(where: Path | str, data: bytes, shape: tuple[int, int]) -> Image:
    """Return the RGB pixels (h, w, 3) of the bytes of a PNG or JPEG, whose name is `where`.

    Raises:
        DamagedFrameError: if they are damaged, or the image has another size.
    """
    _check(where, data, shape)
    image = _decode(where, data, cv2.IMREAD_COLOR_RGB | cv2.IMREAD_IGNORE_ORIENTATION)
    if image.shape != (*shape, 3):
        raise DamagedFrameError(f"{where} must decode to 8-bit colour {shape}, found {image.dtype} {image.shape}")
    return image.astype(np.uint8, copy=False)


def read_packed(path: Path, shape: tuple[int, int]) -> Image:
    """Return the RGB bytes (h, w, 3) of a PNG whose colours hold parts of a larger number.

    Raises:
        DamagedFrameError: if the file is missing or damaged, has another size, or is no 8-bit colour PNG.
    """
    data, header = _read(path, shape)
    if header.image_format != "PNG" or header.mode != "RGB":
        raise DamagedFrameError(
            f"{path} must be a PNG with 8-bit colours that hold the depth, found a {header.image_format} of mode"
            f" {header.mode}: copy the original file"
        )
    return cv2.cvtColor(_decode(path, data, cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB).astype(np.uint8, copy=False)


def read_mask(path: Path, shape: tuple[int, int]) -> Mask:
    """Return a mask (h, w), true where the PNG or JPEG is at least half white.

    Raises:
        DamagedFrameError: if the file is missing or damaged, or has another size.
    """
    data, _ = _read(path, shape)
    return np.asarray(_decode(path, data, cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION) >= 128)


def read_size(path: Path) -> tuple[int, int]:
    """Return (width, height) of a PNG or JPEG, from its first 64 KiB.

    Raises:
        DamagedFrameError: if the file is missing or its header is damaged.
    """
    try:
        with open_regular(path) as file:
            return decode_size(path, file.read(_HEADER_BYTES))
    except OSError as error:
        raise DamagedFrameError(f"{path} cannot be read: {error.strerror}") from error


def decode_size(where: Path | str, data: bytes) -> tuple[int, int]:
    """Return (width, height) of the bytes of a PNG or JPEG, or of their beginning.

    Raises:
        DamagedFrameError: if the header is damaged.
    """
    header, _ = _open(where, data)
    return header.width, header.height


def write_png(path: Path, image: Image | NDArray[np.uint16]) -> None:
    """Write a greyscale (h, w) or RGB (h, w, 3) image; equal input gives equal bytes."""
    _write(path, ".png", image, _PNG_SETTINGS)


def write_jpeg(path: Path, colour: Image) -> None:
    """Write an RGB image (h, w, 3) at quality 95; equal input gives equal bytes."""
    _write(path, ".jpg", colour, _JPEG_SETTINGS)


def _write(path: Path, suffix: str, image: Image | NDArray[np.uint16], settings: tuple[int, ...]) -> None:
    if suffix == ".png" and image.ndim == 2:
        path.write_bytes(encode_png(image))
        return
    encoded = cv2.imencode(suffix, cv2.cvtColor(image, cv2.COLOR_RGB2BGR) if image.ndim == 3 else image, settings)[1]
    path.write_bytes(encoded.tobytes())


def _read(path: Path, shape: tuple[int, int]) -> tuple[bytes, _Header]:
    """Return the bytes and the header of an undamaged file of the expected size."""
    data = _read_bytes(path, shape)
    return data, _check(path, data, shape)


def _read_bytes(path: Path, shape: tuple[int, int]) -> bytes:
    height, width = shape
    try:
        # Eight bytes a pixel exceed every image here uncompressed; the rest is for metadata.
        return read_bounded(path, 8 * height * width + (1 << 20))
    except InputError as error:
        raise DamagedFrameError(str(error)) from error


def _check(path: Path | str, data: bytes, shape: tuple[int, int]) -> _Header:
    """Return the header of an undamaged image of the expected size."""
    height, width = shape
    header, image = _open(path, data)
    if (header.height, header.width) != shape:
        raise DamagedFrameError(
            f"{path} must have the camera's {width}x{height} pixels, found {header.width}x{header.height}"
        )
    try:
        image.verify()
    except Exception as error:  # Pillow raises many types for damaged files
        raise DamagedFrameError(f"{path} is damaged: {error}") from error
    complete = _PNG_END in data if header.image_format == "PNG" else _JPEG_END in data[header.pixels_begin :]
    if not complete:
        raise DamagedFrameError(f"{path} is truncated: it ends after {len(data)} bytes, in the middle of the image")
    return header


def _open(path: Path | str, data: bytes) -> tuple[_Header, Pictures.Image]:
    """Return the header and Pillow's image without decoding its pixels."""
    file = BytesIO(data)
    try:
        image = Pictures.open(file, formats=("PNG", "JPEG"))
    except UnidentifiedImageError as error:
        if (other := _OTHER_FORMATS.get(data[:4])) is not None:
            raise DamagedFrameError(f"{path} is a {other}, no PNG: {_CONVERSION}") from error
        raise DamagedFrameError(
            f"{path} must be a PNG or JPEG image with an intact header,"
            f" found {len(data)} bytes that begin with {data[:4]!r}"
        ) from error
    except Exception as error:  # Pillow raises many types for damaged files
        raise DamagedFrameError(f"{path} is damaged: {error}") from error
    return _Header(str(image.format), image.mode, image.width, image.height, file.tell()), image


def _decode(path: Path | str, data: bytes, flags: int) -> NDArray[np.integer[Any] | np.floating[Any]]:
    try:
        image = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), flags)
    except cv2.error:
        image = None
    if image is None:
        raise DamagedFrameError(f"{path} is damaged: its pixels cannot be decoded")
    return image
