"""Writing of C3D: floats of Intel processors, in millimetres.

Source: The C3D File Format User Guide, c3d.org.
"""

import math
import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from depthtrack.errors import InputError
from depthtrack.files import replace_atomically
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.formats.c3d_parameters import BLOCK
from depthtrack.markers.formats.stored_capture import check_dimensions
from depthtrack.types import Array

_INTEL = 84
_LONGEST_LABEL = 127
_LABELS = 255
"""Labels of a parameter at most, the largest dimension; more follow in LABELS2, LABELS3 and so on."""
_LARGEST_WORD = 0xFFFF
_SCALED = 32_000
"""Largest coordinate in units of POINT:SCALE, which is the unit of residuals too."""
_CHUNK = 1 << 16
"""Frames encoded at a time."""


def write(path: Path, capture: MarkerCapture) -> None:
    """Write a capture, millimetres in single precision. Gaps are 0 0 0 and -1.

    Raises:
        InputError: if the capture has no trajectory or too many, a label is too long, or the file cannot be written.
    """
    check_dimensions(len(capture), len(capture.labels), "a C3D file")
    for label in capture.labels:
        if len(label.encode()) > _LONGEST_LABEL:
            raise InputError(f"a label in C3D must have at most {_LONGEST_LABEL} bytes, found '{label[:40]}...'")
    # The place of the samples stands in the section before them, whose length does not depend on it.
    blocks = len(_parameters(capture, 0)) // BLOCK
    with replace_atomically(path) as temporary, temporary.open("wb") as file:
        file.write(_header(capture, 2 + blocks))
        file.write(_parameters(capture, 2 + blocks))
        for first in range(0, len(capture), _CHUNK):
            chunk = slice(first, first + _CHUNK)
            residuals = None if capture.residuals is None else capture.residuals[chunk]
            file.write(_samples(capture.positions[chunk], residuals, _scale(capture)))
        if len(capture) <= _LARGEST_WORD:
            # Programs without LONG_FRAMES read a longer file to its end: it must not have more frames.
            file.write(b"\0" * (-file.tell() % BLOCK))


def _header(capture: MarkerCapture, data_block: int) -> bytes:
    first = capture.first_frame
    frames = (min(first, _LARGEST_WORD), min(first + len(capture) - 1, _LARGEST_WORD))
    start = struct.pack(
        "<BBHHHHHfHHf", 2, 0x50, len(capture.labels), 0, *frames, 10, -_scale(capture), data_block, 0, capture.rate
    )
    return start.ljust(BLOCK, b"\0")


def _parameters(capture: MarkerCapture, data_block: int) -> bytes:
    count, last = len(capture), capture.first_frame + len(capture) - 1
    point = [
        _parameter("USED", np.array(len(capture.labels), dtype="<u2")),
        _parameter("SCALE", np.array(-_scale(capture), dtype="<f4")),
        _parameter("RATE", np.array(capture.rate, dtype="<f4")),
        _parameter("DATA_START", np.array(data_block, dtype="<u2")),
        _parameter("FRAMES", np.array(min(count, _LARGEST_WORD), dtype="<u2")),
        _parameter("LONG_FRAMES", np.array(count, dtype="<f4")),
        _parameter("UNITS", ["mm"]),
        *_labels(capture.labels),
    ]
    analog = [_parameter("USED", np.array(0, dtype="<u2")), _parameter("RATE", np.array(0, dtype="<f4"))]
    trial = [
        _parameter(f"ACTUAL_{name}_FIELD", np.array([frame & _LARGEST_WORD, frame >> 16], dtype="<u2"))
        for name, frame in (("START", capture.first_frame), ("END", last))
    ]
    records = []
    for number, (name, parameters) in enumerate((("POINT", point), ("ANALOG", analog), ("TRIAL", trial)), start=1):
        records.append(_record(name, -number, b"\0"))
        records += [_record(own, number, body) for own, body in parameters]
    section = b"".join(records) + b"\0\0"
    blocks = math.ceil((len(section) + 4) / BLOCK)
    return (bytes([1, 0x50, min(blocks, 255), _INTEL]) + section).ljust(blocks * BLOCK, b"\0")


def _labels(labels: tuple[str, ...]) -> Iterator[tuple[str, bytes]]:
    for first in range(0, len(labels), _LABELS):
        suffix = "" if first == 0 else str(first // _LABELS + 1)
        yield _parameter(f"LABELS{suffix}", list(labels[first : first + _LABELS]))


def _parameter(name: str, values: Array | list[str] | np.ndarray) -> tuple[str, bytes]:
    """Return a name and its type, dimensions, values and empty description."""
    if isinstance(values, list):
        rows = [row.encode() for row in values]
        width = max(map(len, rows), default=0)
        data = b"".join(row.ljust(width) for row in rows)
        return name, struct.pack("<bBBB", -1, 2, width, len(rows)) + data + b"\0"
    kind = 4 if values.dtype.kind == "f" else 2
    return name, struct.pack("<bB", kind, values.ndim) + bytes(values.shape) + values.tobytes() + b"\0"


def _record(name: str, group: int, body: bytes) -> bytes:
    return struct.pack("<bb", len(name), group) + name.encode() + struct.pack("<H", len(body) + 2) + body


def _scale(capture: MarkerCapture) -> float:
    """Return POINT:SCALE, millimetres."""
    return float(np.nanmax(np.abs(capture.positions), initial=0.001)) * 1000 / _SCALED


def _samples(positions: Array, residuals: Array | None, scale: float) -> bytes:
    """Return frames (T, M, 3), metres, as floats x, y, z and the residual in units of `scale`."""
    measured = np.asarray(np.isfinite(positions).all(axis=-1))
    values = np.zeros((*measured.shape, 4), dtype="<f4")
    values[..., :3] = np.where(measured[..., None], positions * 1000, 0)
    if residuals is not None:
        values[..., 3] = np.ceil(np.nan_to_num(residuals) * 1000 / scale - 0.5).clip(0, 255)
    values[~measured, 3] = -1
    return values.tobytes()
