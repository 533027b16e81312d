"""A gesture of the MSRA15 data set: the folder `P0/1` to `P8/Y`.

| file             | content                                                                          |
|------------------|----------------------------------------------------------------------------------|
| 000000_depth.bin | six 32-bit numbers: width, height, left, top, right, bottom; then 32-bit floats  |
| joint.txt        | number of frames; then a line a frame with x y z (mm) of 21 joints; optional     |

The floats are depth in mm inside [left, right) x [top, bottom), 0 = background. Joints have x right, y up and negative
z in front of the camera. Their order is wrist, index to little finger, thumb, each from root to tip.
Source: Sun et al., "Cascaded hand pose regression", CVPR 2015, and the readme of its data.
"""

import re
from pathlib import Path

import numpy as np

from depthtrack.errors import DamagedFrameError, InputError
from depthtrack.files import read_bounded, read_lines
from depthtrack.geometry.camera import MAX_SIDE, Camera
from depthtrack.hand.benchmark_joints import BENCHMARKS
from depthtrack.number_text import parse_numbers
from depthtrack.recording.reading import ReadingOptions
from depthtrack.recording.sequence import GroundTruth
from depthtrack.recording.sequences.base import BaseSequence
from depthtrack.recording.sequences.numbered_files import has_file, nominal_times, numbered_files
from depthtrack.types import Array, Depth

_DEPTH = re.compile(r"(\d{6})_depth\.bin")
_JOINTS_FILE = "joint.txt"
_BENCHMARK = BENCHMARKS["msra"]
_HEADER_BYTES = 24
_MAX_JOINTS_BYTES = 1 << 26
_TO_CAMERA = np.array([0.001, -0.001, -0.001])
"""Factors from x y z in mm, y up and z backward, to metres in the camera frame."""


class Msra15Sequence(BaseSequence):
    """A gesture of one subject, depth alone, with joints if there is a `joint.txt`."""

    format_name = "a folder with 000000_depth.bin (MSRA15)"

    def _open(self, camera: Camera | None) -> None:
        """See `BaseSequence`."""
        self.camera = camera or _BENCHMARK.camera
        files = numbered_files(self.path, _DEPTH)
        self._files = list(files.values())
        self.timestamps = nominal_times(list(files))
        self.description = {"data set": "MSRA15", "source": _BENCHMARK.source}
        if (self.path / _JOINTS_FILE).exists():
            joints = read_joints(self.path / _JOINTS_FILE)
            self.ground_truth = GroundTruth(
                nominal_times(list(range(len(joints)))), joints=_BENCHMARK.to_keypoints(joints)
            )

    @classmethod
    def matches(cls, path: Path) -> bool:
        """See `BaseSequence`."""
        return has_file(path, _DEPTH)

    @classmethod
    def image_size(cls, path: Path, reading: ReadingOptions | None = None) -> tuple[int, int]:
        """Return (width, height) that the first readable depth image states.

        Raises:
            InputError: if none can be read.
        """
        for name in numbered_files(path, _DEPTH).values():
            try:
                size, _ = _read(path / name)
                return size
            except DamagedFrameError:
                continue
        raise InputError(f"{path}: none of the depth images can be read")

    def read_depth(self, index: int) -> Depth:
        """See `BaseSequence`."""
        path = self.path / self._files[index]
        (width, height), depth = _read(path)
        if (height, width) != self.camera.shape:
            raise DamagedFrameError(
                f"{path} must have the camera's {self.camera.width}x{self.camera.height} pixels, found {width}x{height}"
            )
        return depth


def read_joints(path: Path) -> Array:
    """Return the joints (T, 21, 3) of a `joint.txt` in its order, metres, camera frame.

    Raises:
        InputError: if the number of lines differs from the first line, or a line is no 63 numbers with negative z.
    """
    lines = [line for line in read_lines(path, _MAX_JOINTS_BYTES) if line.strip()]
    stated = lines[0].strip() if lines else ""
    if stated != str(len(lines) - 1) or len(lines) < 2:
        raise InputError(
            f"{path} must begin with the number of lines below it, found {stated[:20]!r} and {max(0, len(lines) - 1)}"
            " lines: copy the file again"
        )
    rows = []
    for number, line in enumerate(lines[1:], start=2):
        try:
            row = np.array(parse_numbers(line.split()))
        except ValueError:
            row = np.zeros(0)
        if row.shape != (63,) or not np.all(np.abs(row) < 1e5) or not np.all(row[2::3] < 0):
            raise InputError(
                f"{path}, line {number}: expected x y z in mm of 21 joints with negative z, found"
                f" {len(line.split())} fields beginning with {line.strip()[:40]!r}"
            )
        rows.append(row.reshape(21, 3))
    return np.array(rows) * _TO_CAMERA


def _read(path: Path) -> tuple[tuple[int, int], Depth]:
    """Return the stated (width, height) and the depth (h, w), metres."""
    try:
        data = read_bounded(path, _HEADER_BYTES + 4 * 4096 * 4096)
    except InputError as error:
        raise DamagedFrameError(str(error)) from error
    if len(data) < _HEADER_BYTES:
        raise DamagedFrameError(f"{path} is truncated: it must begin with 24 bytes of sizes, found {len(data)}")
    width, height, left, top, right, bottom = (int(x) for x in np.frombuffer(data, "<u4", 6))
    if not (left <= right <= width <= MAX_SIDE and top <= bottom <= height <= MAX_SIDE):
        raise DamagedFrameError(
            f"{path} must hold a region inside its image, found columns {left} to {right} of {width},"
            f" rows {top} to {bottom} of {height}"
        )
    expected = _HEADER_BYTES + 4 * (right - left) * (bottom - top)
    if len(data) != expected:
        raise DamagedFrameError(f"{path} must have {expected:,} bytes by its header, found {len(data):,}")
    region = np.frombuffer(data, "<f4", offset=_HEADER_BYTES).reshape(bottom - top, right - left)
    depth = np.zeros((height, width), dtype=np.float32)
    depth[top:bottom, left:right] = np.where((region > 0) & (region < 1e5), region, 0) * np.float32(0.001)
    return (width, height), depth
