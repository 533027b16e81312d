"""The `train` or `test` folder of the NYU hand pose data set, first of its three cameras.

| file                | content                                                            |
|---------------------|--------------------------------------------------------------------|
| depth_1_0000001.png | depth in mm, packed in 8-bit colours: 256 times green plus blue    |
| rgb_1_0000001.png   | colour, registered to the depth; optional                          |
| joint_data.mat      | `joint_xyz`, (cameras, frames, 36, 3) mm, y up; optional           |

Runs are compared on the 14 joints of the benchmark. 11 of them are keypoints; two wrist points and the palm are not.
Source: Tompson et al., "Real-time continuous pose recovery of human hands", ACM Trans. Graphics 33(5), 2014.
"""

import re
from pathlib import Path

import numpy as np
import scipy.io

from depthtrack.errors import InputError
from depthtrack.files import check_size
from depthtrack.geometry.camera import Camera
from depthtrack.hand.benchmark_joints import BENCHMARKS
from depthtrack.recording.images import read_colour, read_packed
from depthtrack.recording.reading import ReadingOptions
from depthtrack.recording.sequence import BenchmarkJoints, GroundTruth
from depthtrack.recording.sequences.base import BaseSequence
from depthtrack.recording.sequences.numbered_files import first_size, has_file, nominal_times, numbered_files
from depthtrack.types import Array, Depth, Image

JOINT_ROWS = (0, 3, 6, 9, 12, 15, 18, 21, 24, 25, 27, 30, 31, 32)
"""The benchmark's joints among the 36 of `joint_data.mat`."""

_DEPTH, _COLOUR = re.compile(r"depth_1_(\d{7})\.png"), re.compile(r"rgb_1_(\d{7})\.png")
_JOINTS_FILE, _JOINTS = "joint_data.mat", "joint_xyz"
_BENCHMARK = BENCHMARKS["nyu"]
_CAMERAS, _MOST_FRAMES, _FILE_JOINTS = 3, 200_000, 36
_MAX_BYTES = 1 << 30
_TO_CAMERA = np.array([0.001, -0.001, 0.001])
"""Factors from x y z in mm, y up, to metres in the camera frame."""


class NyuSequence(BaseSequence):
    """The frames of the first camera, with joints if there is a `joint_data.mat`."""

    format_name = "a folder with depth_1_0000001.png (NYU)"

    def _open(self, camera: Camera | None) -> None:
        """See `BaseSequence`."""
        self.camera = camera or _BENCHMARK.camera
        files = numbered_files(self.path, _DEPTH)
        self._numbers, self._files = list(files), list(files.values())
        self._colours = numbered_files(self.path, _COLOUR) if has_file(self.path, _COLOUR) else {}
        self.has_colour = any(number in self._colours for number in files)
        self.timestamps = nominal_times([number - 1 for number in files])
        self.description = {"data set": "NYU", "source": _BENCHMARK.source}
        if (self.path / _JOINTS_FILE).exists():
            positions = read_joints(self.path / _JOINTS_FILE)
            self.ground_truth = GroundTruth(
                nominal_times(list(range(len(positions)))),
                joints=_BENCHMARK.to_keypoints(positions),
                benchmark=BenchmarkJoints(_BENCHMARK, positions),
            )

    @classmethod
    def matches(cls, path: Path) -> bool:
        """See `BaseSequence`."""
        return has_file(path, _DEPTH)

    @classmethod
    def image_size(cls, path: Path, reading: ReadingOptions | None = None) -> tuple[int, int]:
        """See `BaseSequence`."""
        return first_size(path, _DEPTH)

    def read_depth(self, index: int) -> Depth:
        """See `BaseSequence`."""
        packed = read_packed(self.path / self._files[index], self.camera.shape).astype(np.uint16)
        return self.camera.metres(256 * packed[..., 1] + packed[..., 2])

    def read_colour(self, index: int) -> Image | None:
        """See `BaseSequence`."""
        name = self._colours.get(self._numbers[index])
        return None if name is None else read_colour(self.path / name, self.camera.shape)


def read_joints(path: Path) -> Array:
    """Return the benchmark's joints (T, 14, 3) of the first camera, metres, camera frame.

    Raises:
        InputError: if the file is no MATLAB file of version 5 with `joint_xyz` of the stated size.
    """
    check_size(path, _MAX_BYTES)
    try:
        shapes = {name: (shape, kind) for name, shape, kind in scipy.io.whosmat(path)}
    except Exception as error:  # SciPy raises many types for damaged and newer files
        raise InputError(f"{path} must be a MATLAB file of version 5, found: {_one_line(error)}") from error
    shape, kind = shapes.get(_JOINTS, ((), "nothing"))
    fits = len(shape) == 4 and shape[0] <= _CAMERAS and shape[1] <= _MOST_FRAMES and shape[2:] == (_FILE_JOINTS, 3)
    if not fits or kind not in ("double", "single") or 0 in shape:
        raise InputError(
            f"{path} must hold {_JOINTS} of size (cameras, frames, {_FILE_JOINTS}, 3) in mm, found {kind} {shape}"
        )
    try:
        xyz = scipy.io.loadmat(path, variable_names=[_JOINTS])[_JOINTS]
    except Exception as error:  # as above
        raise InputError(f"{path} is damaged: {_one_line(error)}") from error
    joints = np.asarray(xyz[0][:, JOINT_ROWS], dtype=np.float64) * _TO_CAMERA
    return np.where((joints[..., 2:] > 0) & np.isfinite(joints).all(axis=-1, keepdims=True), joints, np.nan)


def _one_line(error: Exception) -> str:
    """Return the text of an error as one line of printable characters."""
    return "".join(c if c.isprintable() else " " for c in str(error))[:200]
