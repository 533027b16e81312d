"""Depth and colour of sensor_msgs Image and CompressedImage.

Sources: ROS REP 118 (depth images), image_transport_plugins (compressedDepth), sensor_msgs/image_encodings.h.
"""

import struct
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from depthtrack.errors import DamagedFrameError, InputError
from depthtrack.geometry.camera import MAX_SIDE
from depthtrack.recording.images import decode_colour, decode_depth, decode_size
from depthtrack.recording.rvl import decompress
from depthtrack.types import Depth, Image

IMAGE, COMPRESSED_IMAGE = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"

_UNITS = {"16uc1", "mono16", "z16", "y16"}
_METRES = {"32fc1"}
_FROM_BYTES: dict[str, tuple[int, int | None]] = {
    "rgb8": (3, None),
    "8uc3": (3, cv2.COLOR_BGR2RGB),
    "bgr8": (3, cv2.COLOR_BGR2RGB),
    "rgba8": (4, cv2.COLOR_RGBA2RGB),
    "bgra8": (4, cv2.COLOR_BGRA2RGB),
    "mono8": (1, cv2.COLOR_GRAY2RGB),
    "8uc1": (1, cv2.COLOR_GRAY2RGB),
    "yuv422": (2, cv2.COLOR_YUV2RGB_UYVY),
    "uyvy": (2, cv2.COLOR_YUV2RGB_UYVY),
    "yuv422_yuy2": (2, cv2.COLOR_YUV2RGB_YUY2),
    "yuyv": (2, cv2.COLOR_YUV2RGB_YUY2),
    "yuy2": (2, cv2.COLOR_YUV2RGB_YUY2),
    # OpenCV names the pattern by the second row.
    "bayer_rggb8": (1, cv2.COLOR_BayerBG2RGB),
    "bayer_bggr8": (1, cv2.COLOR_BayerRG2RGB),
    "bayer_gbrg8": (1, cv2.COLOR_BayerGR2RGB),
    "bayer_grbg8": (1, cv2.COLOR_BayerGB2RGB),
}
"""Bytes a pixel of each colour encoding, and OpenCV's conversion to RGB."""
_JPEG = {"mjpg", "mjpeg", "jpeg"}
_PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_DEPTH_HEADER = 12
"""Bytes before the PNG of compressedDepth: a format and two parameters of quantised inverse depth."""
_RVL_HEADER = _DEPTH_HEADER + 8
"""Bytes before the RVL data of compressedDepth: the same, then width and height."""


def encoding_of(message: Any) -> str:
    """Return the encoding of the pixels in lower case, for a compressed image too."""
    text = message.encoding if hasattr(message, "encoding") else str(message.format).partition(";")[0]
    return str(text).strip().lower()


def is_depth(message: Any) -> bool:
    """Return whether a message may hold depth: one channel of 16 bits, or of floats."""
    return encoding_of(message) in _UNITS | _METRES


def is_colour(message: Any) -> bool:
    """Return whether a message holds colour that can be read."""
    encoding = encoding_of(message)
    if hasattr(message, "encoding"):
        return encoding in _FROM_BYTES or encoding in _JPEG
    return encoding in _FROM_BYTES or encoding in ("jpeg", "jpg", "png")


def size_of_image(message: Any, where: str) -> tuple[int, int]:
    """Return (width, height).

    Raises:
        DamagedFrameError: if the sides are out of range, or a compressed image has no intact header.
    """
    if hasattr(message, "encoding"):
        width, height = int(message.width), int(message.height)
    else:
        data = bytes(message.data)
        width, height = _rvl_size(data, where) if _is_rvl(message) else decode_size(where, _png_of(data))
    if not (1 <= width <= MAX_SIDE and 1 <= height <= MAX_SIDE):
        raise DamagedFrameError(f"{where}: an image must have sides from 1 to {MAX_SIDE} pixels")
    return width, height


def depth_of(message: Any, unit: float, shape: tuple[int, int], where: str) -> Depth:
    """Return the depth (h, w) of a message, metres, 0 = none.

    unit: metres per unit of 16-bit depth.

    Raises:
        DamagedFrameError: if it is no depth, has another size, or is damaged.
    """
    encoding = encoding_of(message)
    if encoding not in _UNITS | _METRES:
        raise DamagedFrameError(
            f"{where}: depth must have the encoding 16UC1 or 32FC1, found {encoding[:40]!r}:"
            " this is a picture, so choose another --depth-topic"
        )
    if hasattr(message, "encoding"):
        kind = "f4" if encoding in _METRES else "u2"
        stored = _rows(message, np.dtype(kind), 1, shape, where)[..., 0]
        return _clean(stored.astype(np.float32)) if kind == "f4" else stored.astype(np.float32) * np.float32(unit)
    data = bytes(message.data)
    stored = _rvl_depth(data, shape, where) if _is_rvl(message) else decode_depth(where, _png_of(data), shape)
    if encoding in _UNITS:
        return stored.astype(np.float32) * np.float32(unit)
    if data[:8] == _PNG_SIGNATURE:
        raise DamagedFrameError(f"{where}: compressed depth of floats must have a header before its PNG")
    _, a, b = struct.unpack("<iff", data[:_DEPTH_HEADER])
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return _clean(np.where(stored > 0, np.float32(a) / (stored.astype(np.float32) - np.float32(b)), 0))


def colour_of(message: Any, shape: tuple[int, int], where: str) -> Image:
    """Return the RGB image (h, w, 3) of a message.

    Raises:
        DamagedFrameError: if it is no colour, has another size, or is damaged.
    """
    encoding = encoding_of(message)
    if not hasattr(message, "encoding") or encoding in _JPEG:
        return decode_colour(where, bytes(message.data), shape)
    if encoding not in _FROM_BYTES:
        raise DamagedFrameError(f"{where}: colour in the encoding {encoding[:40]!r} is not read: record it as rgb8")
    channels, conversion = _FROM_BYTES[encoding]
    pixels = _rows(message, np.dtype("u1"), channels, shape, where)
    if channels == 1:
        pixels = pixels[..., 0]
    converted = pixels if conversion is None else cv2.cvtColor(np.ascontiguousarray(pixels), conversion)
    return np.ascontiguousarray(converted, dtype=np.uint8)


def _is_rvl(message: Any) -> bool:
    """Return whether depth is compressed by RVL."""
    return "rvl" in str(getattr(message, "format", "")).lower()


def _rvl_size(data: bytes, where: str) -> tuple[int, int]:
    """Return the (width, height) that stand before RVL data. Raises DamagedFrameError."""
    if len(data) < _RVL_HEADER:
        raise DamagedFrameError(f"{where}: RVL depth must have a header of {_RVL_HEADER} bytes, found {len(data)}")
    width, height = struct.unpack_from("<II", data, _DEPTH_HEADER)
    return width, height


def _rvl_depth(data: bytes, shape: tuple[int, int], where: str) -> NDArray[np.uint16]:
    """Return the stored values (h, w) of RVL data. Raises DamagedFrameError."""
    height, width = shape
    found = _rvl_size(data, where)
    if found != (width, height):
        raise DamagedFrameError(f"{where} must have {width}x{height} pixels, found {found[0]}x{found[1]}")
    try:
        return decompress(data[_RVL_HEADER:], width * height).reshape(shape)
    except InputError as error:
        raise DamagedFrameError(f"{where}: {error}") from error


def _rows(message: Any, kind: np.dtype[Any], channels: int, shape: tuple[int, int], where: str) -> NDArray[Any]:
    """Return the pixels (h, w, channels) of an Image, whose rows may be padded."""
    height, width = int(message.height), int(message.width)
    if (height, width) != shape:
        raise DamagedFrameError(f"{where} must have {shape[1]}x{shape[0]} pixels, found {width}x{height}")
    data = np.asarray(message.data).view(np.uint8).ravel()
    row = width * channels * kind.itemsize
    step = int(message.step) or row
    if step < row or len(data) < step * (height - 1) + row:
        raise DamagedFrameError(f"{where}: an image of {width}x{height} must have {row * height:,} bytes")
    padded = np.zeros(step * height, dtype=np.uint8)
    padded[: min(len(data), step * height)] = data[: step * height]
    pixels = np.ascontiguousarray(padded.reshape(height, step)[:, :row])
    return pixels.view(kind.newbyteorder(">" if message.is_bigendian else "<")).reshape(height, width, channels)


def _clean(depth: NDArray[Any]) -> Depth:
    """Return depth with 0 in place of values that are not finite or not positive."""
    return np.where(np.isfinite(depth) & (depth > 0), depth, 0).astype(np.float32)


def _png_of(data: bytes) -> bytes:
    """Return the image of a compressed message without the header of compressedDepth."""
    return data[_DEPTH_HEADER:] if data[_DEPTH_HEADER : _DEPTH_HEADER + 8] == _PNG_SIGNATURE else data
