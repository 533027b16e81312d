"""A recording of OpenNI 1 or 2: a `.oni` file of a Kinect, Xtion or Astra.

It is a list of records behind a header. A record has a magic number, a type, the number of its node, the size of its
fields and of the data behind them. The depth node states its compression, its properties state the size of the image
(`xnMapOutputMode`), the field of view (`xnFOV`) and the unit (`oniPixelFormat`).
Source: PrimeSense, OpenNI 2, Drivers/OniFile/DataRecords.h.
"""

import math
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

import numpy as np

from depthtrack.errors import DamagedFrameError, InputError
from depthtrack.files import open_regular
from depthtrack.geometry.camera import MAX_SIDE, Camera
from depthtrack.recording import depth16z
from depthtrack.recording.reading import ReadingOptions
from depthtrack.recording.sequences.base import BaseSequence
from depthtrack.recording.sequences.tum_lists import MAX_FRAMES
from depthtrack.types import Depth

_FILE_MAGIC, _RECORD_MAGIC = b"NI10", b"NIR\0"
_FILE_HEADER, _RECORD = struct.Struct("<4s2BHIQI"), struct.Struct("<4s4I")
_LONG_VERSION = (1, 0, 1)
"""Version from which the position at the end of a record's header has 8 bytes instead of 4."""
_NODE_ADDED, _PROPERTIES, _DATA, _END = (0x02, 0x0C, 0x0D), (0x03, 0x06), 0x0A, 0x0B
_DEPTH_NODE = 2
_MOST_FIELD_BYTES = 1 << 20
_UNITS = {100: 0.001, 101: 0.0001}
"""Metres per unit by `oniPixelFormat`."""


@dataclass(frozen=True)
class _Record:
    """Type, node, fields, and the place of the data behind them."""

    kind: int
    node: int
    fields: bytes
    offset: int
    size: int


@dataclass
class _DepthNode:
    """What a file states of its depth.

    frames: offset and size of the data, bytes, and time, microseconds.
    """

    codec: bytes = b""
    width: int = 0
    height: int = 0
    unit: float = 0.001
    field_of_view: tuple[float, float] | None = None
    frames: list[tuple[int, int, int]] = field(default_factory=list)
    truncated: bool = True


class OniSequence(BaseSequence):
    """The depth of a `.oni` file, up to the last complete frame if it is cut short."""

    format_name = "a .oni file (OpenNI)"

    def _open(self, camera: Camera | None) -> None:
        """See `BaseSequence`."""
        self._depth = _read(self.path)
        self.camera = camera or _stated_camera(self.path, self._depth)
        times = np.array([time for _, _, time in self._depth.frames], dtype=np.float64) / 1e6
        later = np.concatenate([[True], np.diff(np.maximum.accumulate(times)) > 0])
        self._frames = [frame for frame, kept in zip(self._depth.frames, later, strict=True) if kept]
        self.timestamps = times[later]
        self.description = {"recorder": "OpenNI"}
        if not later.all():
            self.notes.append(f"{int(np.sum(~later))} frames whose time does not increase are left out")
        if self._depth.truncated:
            self.notes.append(f"{self.path} is cut short: the {len(self._frames)} frames before the cut are read")
        self.notes.append("colour is not used: a .oni file does not state the cameras that would register it")

    @classmethod
    def matches(cls, path: Path) -> bool:
        """See `BaseSequence`."""
        if not path.is_file():
            return False
        with open_regular(path) as file:
            return file.read(4) == _FILE_MAGIC

    @classmethod
    def image_size(cls, path: Path, reading: ReadingOptions | None = None) -> tuple[int, int]:
        """Return (width, height) of the depth, which the file states.

        Raises:
            InputError: if the file has no depth.
        """
        depth = _read(path)
        return depth.width, depth.height

    def read_depth(self, index: int) -> Depth:
        """See `BaseSequence`."""
        depth, (offset, size, _) = self._depth, self._frames[index]
        if (depth.height, depth.width) != self.camera.shape:
            raise DamagedFrameError(
                f"{self.path} must have the camera's {self.camera.width}x{self.camera.height} pixels, found"
                f" {depth.width}x{depth.height}"
            )
        count = depth.width * depth.height
        if size > 4 * count + (1 << 18):
            raise DamagedFrameError(
                f"{self.path}: frame {index} must be smaller than {4 * count:,} bytes, found {size:,}"
            )
        try:
            with open_regular(self.path) as file:
                file.seek(offset)
                data = file.read(size)
            values = _CODEC[depth.codec](data, count)
        except (OSError, ValueError) as error:
            raise DamagedFrameError(f"{self.path}: frame {index} is damaged: {error}") from error
        return values.reshape(depth.height, depth.width).astype(np.float32) * np.float32(depth.unit)


def _raw(data: bytes, count: int) -> np.ndarray[tuple[int, ...], np.dtype[np.uint16]]:
    if len(data) != 2 * count:
        raise ValueError(f"it must have {2 * count:,} bytes, found {len(data):,}")
    return np.frombuffer(data, "<u2").astype(np.uint16)


_CODEC = {b"16zT": depth16z.decompress_with_table, b"16zP": depth16z.decompress, b"NONE": _raw}


def _read(path: Path) -> _DepthNode:
    """Return what the file states of its first depth node.

    Raises:
        InputError: if it has none, or no complete frame.
    """
    found, number = _DepthNode(), None
    try:
        with open_regular(path) as file:
            for record in _records(file, path):
                if record.kind == _END:
                    found.truncated = False
                    break
                if record.kind in _NODE_ADDED and number is None:
                    number, found.codec = _depth_node(record)
                elif record.node == number and record.kind in _PROPERTIES:
                    _take_property(found, record.fields)
                elif record.node == number and record.kind == _DATA:
                    found.frames.append((record.offset, record.size, struct.unpack_from("<Q", record.fields)[0]))
                    if len(found.frames) > MAX_FRAMES:
                        raise InputError(f"{path} holds more than {MAX_FRAMES:,} frames: split it")
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from error
    except struct.error as error:
        raise InputError(f"{path} is damaged: the fields of a record are too short") from error
    if number is None or not found.frames:
        raise InputError(f"{path} must hold depth, found {'no frame' if number is not None else 'no depth node'}")
    if not (1 <= found.width <= MAX_SIDE and 1 <= found.height <= MAX_SIDE):
        raise InputError(f"{path} must state the size of its depth, found {found.width}x{found.height}")
    if found.codec not in _CODEC:
        raise InputError(
            f"{path} must hold depth without compression or as 16z, found {found.codec!r}: record it with OpenNI 2"
        )
    return found


def _records(file: BinaryIO, path: Path) -> Iterator[_Record]:
    """Yield the complete records of a file.

    Raises:
        InputError: if its header is damaged.
    """
    header = file.read(_FILE_HEADER.size)
    if len(header) < _FILE_HEADER.size:
        raise InputError(f"{path} is cut within its header")
    _, major, minor, maintenance, *_ = _FILE_HEADER.unpack(header)
    link_bytes = 8 if (major, minor, maintenance) >= _LONG_VERSION else 4
    end, offset = path.stat().st_size, _FILE_HEADER.size
    while len(head := file.read(_RECORD.size)) == _RECORD.size:
        mark, kind, node, field_bytes, size = _RECORD.unpack(head)
        begin = _RECORD.size + link_bytes
        if mark != _RECORD_MAGIC or not begin <= field_bytes <= _MOST_FIELD_BYTES or offset + field_bytes + size > end:
            return
        file.seek(link_bytes, 1)
        fields = file.read(field_bytes - begin)
        yield _Record(kind, node, fields, offset + field_bytes, size)
        offset += field_bytes + size
        file.seek(offset)


def _depth_node(record: _Record) -> tuple[int | None, bytes]:
    """Return the number and the compression of a depth node; None for another node."""
    (length,) = struct.unpack_from("<I", record.fields)
    kind, codec = struct.unpack_from("<I4s", record.fields, 4 + length)
    return (record.node, codec) if kind == _DEPTH_NODE else (None, b"")


def _take_property(depth: _DepthNode, fields: bytes) -> None:
    (length,) = struct.unpack_from("<I", fields)
    name = fields[4 : 4 + length].rstrip(b"\0")
    value = fields[8 + length :]
    if name == b"xnMapOutputMode":
        depth.width, depth.height = struct.unpack_from("<2I", value)
    elif name == b"oniPixelFormat":
        depth.unit = _UNITS.get(struct.unpack_from("<Q", value)[0], depth.unit)
    elif name == b"xnFOV":
        depth.field_of_view = struct.unpack_from("<2d", value)


def _stated_camera(path: Path, depth: _DepthNode) -> Camera:
    """Return the camera of the stated field of view.

    Raises:
        InputError: if none is stated.
    """
    if depth.field_of_view is None or not all(0.01 < angle < 2.9 for angle in depth.field_of_view):
        raise InputError(
            f"{path} states no field of view: give the camera with --camera FILE.json, --camera-preset NAME, or --fx"
            " and --depth-scale"
        )
    across, down = (math.tan(angle / 2) for angle in depth.field_of_view)
    width, height = depth.width, depth.height
    cx, cy = (width - 1) / 2, (height - 1) / 2
    return Camera(width, height, width / 2 / across, height / 2 / down, cx, cy, depth.unit)
