"""A recording of Record3D on an iPhone or iPad: a `.r3d` file, which is a zip file.

| member        | content                                                                                   |
|---------------|-------------------------------------------------------------------------------------------|
| metadata      | JSON: colour size `w`, `h`; depth size `dw`, `dh`; `K` by columns; `fps`; `frameTimestamps` |
| rgbd/0.depth  | 32-bit floats, metres, compressed with LZFSE                                              |
| rgbd/0.jpg    | colour, whose pixels and the depth's cover the same image                                 |

`perFrameIntrinsicCoeffs` has fx, fy, cx, cy of each frame, which change with the focus. Their median is used.
Source: M. Simonik, Record3D, and its documentation of the format.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from depthtrack.errors import DamagedFrameError, InputError
from depthtrack.files import open_regular
from depthtrack.geometry.camera import MAX_SIDE, Camera
from depthtrack.recording.images import decode_colour
from depthtrack.recording.lzfse import decompress
from depthtrack.recording.reading import ReadingOptions
from depthtrack.recording.sequences.base import BaseSequence
from depthtrack.recording.zip_members import ZipMembers
from depthtrack.strict_data import parse_json
from depthtrack.types import Array, Depth, Image

_DEPTH, _COLOUR = re.compile(r"rgbd/(\d{1,9})\.depth"), re.compile(r"rgbd/(\d{1,9})\.jpe?g")
_METADATA = "metadata"
_MAX_METADATA_BYTES = 1 << 28
_MAX_JPEG_BYTES = 1 << 25
_DEPTH_SCALE = 0.0001
"""Metres per unit if the recording is converted to whole numbers: 0.1 mm up to 6.5 m."""
_OLD_DEPTH_SIZES = ((480, 640), (192, 256))
"""Shorter and longer side of the depth in files that do not state it: TrueDepth and LiDAR."""
_FOCUS_CHANGE = 0.005
"""Relative range of the focal length above which a note says so: 1.5 mm for a finger 0.3 m from the axis."""
_COARSE = 300
"""Pixels of the shorter side below which fingers have too few readings."""


class Record3dSequence(BaseSequence):
    """The frames of a `.r3d` file, up to the last complete one if it is cut short."""

    format_name = "a .r3d file (Record3D)"

    def _open(self, camera: Camera | None) -> None:
        """See `BaseSequence`."""
        self._zip = ZipMembers.of(self.path)
        metadata = _metadata(self._zip)
        depths, colours = self._zip.numbered(_DEPTH), self._zip.numbered(_COLOUR)
        self._depths = list(depths.values())
        self._colours = [colours.get(number) for number in depths]
        self.has_colour = any(self._colours)
        self._colour_shape = _side(metadata, "h"), _side(metadata, "w")
        self._shape = _depth_shape(metadata, self._colour_shape)
        self.camera = camera or self._stated_camera(metadata, list(depths))
        self.timestamps = self._times(metadata, list(depths))
        self.description = {"app": "Record3D"}
        if self._zip.truncated:
            self.notes.append(f"{self.path} is cut short: the {len(depths)} frames before the cut are read")
        if min(self._shape) < _COARSE:
            height, width = self._shape
            self.notes.append(
                f"the depth of {width}x{height} pixels is too coarse for fingers: record with the front camera"
            )

    @classmethod
    def matches(cls, path: Path) -> bool:
        """See `BaseSequence`."""
        if not path.is_file():
            return False
        with open_regular(path) as file:
            if file.read(4) != b"PK\3\4":
                return False
        try:
            return bool(ZipMembers.of(path).numbered(_DEPTH))
        except InputError:
            return False

    @classmethod
    def image_size(cls, path: Path, reading: ReadingOptions | None = None) -> tuple[int, int]:
        """Return (width, height) of the depth, which the metadata states.

        Raises:
            InputError: if they are missing or malformed.
        """
        metadata = _metadata(ZipMembers.of(path))
        height, width = _depth_shape(metadata, (_side(metadata, "h"), _side(metadata, "w")))
        return width, height

    def read_depth(self, index: int) -> Depth:
        """See `BaseSequence`."""
        if self._shape != self.camera.shape:
            raise DamagedFrameError(
                f"{self.path} has depth of {self._shape[1]}x{self._shape[0]} pixels, but the camera has"
                f" {self.camera.width}x{self.camera.height}"
            )
        name, size = self._depths[index], 4 * self._shape[0] * self._shape[1]
        data = self._zip.read(name, size + (1 << 16))
        if len(data) != size:  # else it is stored as it is
            try:
                data = decompress(data, size)
            except InputError as error:
                raise DamagedFrameError(f"{self.path}: {name}: {error}") from error
        depth = np.frombuffer(data, "<f4").reshape(self._shape)
        return np.where((depth > 0) & (depth < 100), depth, 0).astype(np.float32, copy=False)

    def read_colour(self, index: int) -> Image | None:
        """See `BaseSequence`."""
        name = self._colours[index]
        if name is None:
            return None
        colour = decode_colour(f"{self.path}: {name}", self._zip.read(name, _MAX_JPEG_BYTES), self._colour_shape)
        if self._colour_shape == self._shape:
            return colour
        size = self._shape[1], self._shape[0]
        return np.asarray(cv2.resize(colour, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)

    def _stated_camera(self, metadata: Mapping[str, Any], numbers: list[int]) -> Camera:
        """Return the camera of the depth image.

        Raises:
            InputError: if the metadata has no intrinsics.
        """
        K = _numbers(metadata.get("K"), (9,))
        coefficients = _numbers(metadata.get("perFrameIntrinsicCoeffs"), (None, 4))
        if coefficients is not None and len(coefficients) > max(numbers):
            used = coefficients[numbers]
            fx, fy, cx, cy = np.median(used, axis=0).tolist()
            change = float(np.ptp(used[:, 0]) / fx) if fx > 0 else 0.0
            if change > _FOCUS_CHANGE:
                self.notes.append(
                    f"the focal length changes by {100 * change:.1f} % with the focus: the median is used"
                )
        elif K is not None:
            fx, fy, cx, cy = (float(K[i]) for i in (0, 4, 6, 7))
        else:
            raise InputError(
                f"{self.path}: {_METADATA} has no intrinsics K: give the camera with --camera FILE.json, or --fx and"
                " --depth-scale"
            )
        (colour_height, colour_width), (height, width) = self._colour_shape, self._shape
        across, down = width / colour_width, height / colour_height
        # The outer corners of both images are the same.
        cx, cy = (cx + 0.5) * across - 0.5, (cy + 0.5) * down - 0.5
        return Camera(width, height, fx * across, fy * down, cx, cy, _DEPTH_SCALE)

    def _times(self, metadata: Mapping[str, Any], numbers: list[int]) -> Array:
        """Return the times (N,), seconds, of the frames with these numbers.

        Raises:
            InputError: if neither times nor a rate are stated.
        """
        stated = _numbers(metadata.get("frameTimestamps"), (None,))
        if stated is not None and len(stated) > max(numbers):
            times = stated[numbers]
            if np.all(np.diff(times) > 0):
                return times
            self.notes.append("the stated times do not increase: the rate gives the times")
        rate = metadata.get("fps")
        if not isinstance(rate, int | float) or not 0 < rate <= 1000:
            raise InputError(f"{self.path}: {_METADATA} must state fps, frames a second, found {str(rate)[:40]!r}")
        return np.array(numbers, dtype=np.float64) / rate


def _metadata(members: ZipMembers) -> Mapping[str, Any]:
    """Return the parsed metadata.

    Raises:
        InputError: if it is missing or no JSON object.
    """
    where = f"{members.path}: {_METADATA}"
    if _METADATA not in members.members and members.truncated:
        raise InputError(f"{where} is missing, because the file is cut short: copy it again from the device")
    data = members.read(_METADATA, _MAX_METADATA_BYTES)
    try:
        fields = parse_json(data, undefined=True)
    except ValueError as error:
        raise InputError(f"{where} must be JSON, found {data[:20]!r}: {error}") from error
    if not isinstance(fields, dict):
        raise InputError(f"{where} must be a JSON object, found {type(fields).__name__}")
    return fields


def _side(metadata: Mapping[str, Any], name: str) -> int:
    side = metadata.get(name)
    if not isinstance(side, int) or isinstance(side, bool) or not 1 <= side <= MAX_SIDE:
        raise InputError(f"{_METADATA} must state {name}, a number of pixels, found {str(side)[:40]!r}")
    return side


def _depth_shape(metadata: Mapping[str, Any], colour_shape: tuple[int, int]) -> tuple[int, int]:
    """Return (height, width) of the depth, which old files do not state."""
    if "dw" in metadata:
        return _side(metadata, "dh"), _side(metadata, "dw")
    height, width = colour_shape
    shorter, longer = _OLD_DEPTH_SIZES[0] if min(colour_shape) == _OLD_DEPTH_SIZES[0][0] else _OLD_DEPTH_SIZES[1]
    return (longer, shorter) if height > width else (shorter, longer)


def _numbers(value: Any, shape: tuple[int | None, ...]) -> Array | None:
    """Return finite numbers of a shape, in which None is any size; None for anything else."""
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        return None
    fits = array.ndim == len(shape) and all(n in (None, m) for n, m in zip(shape, array.shape, strict=True))
    return array if fits and array.size and np.isfinite(array).all() else None
