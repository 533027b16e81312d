"""A sequence of HO-3D, version 2 or 3: the folder `train/ABF10`.

| file           | content                                                                            |
|----------------|------------------------------------------------------------------------------------|
| depth/0000.png | depth in the pixels of the colour camera, packed in 8-bit colours: red + 256 green |
| rgb/0000.jpg   | colour, JPEG or PNG; optional                                                      |
| meta/0000.pkl  | `camMat` (3, 3) px, `handJoints3D` (21, 3) m, y up and z backward                  |

The joints are in the order of MANO, with the tips last. The evaluation sequences state the wrist alone.
Source: Hampali et al., "HOnnotate: a method for 3D annotation of hand and object poses", CVPR 2020, and its scripts.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from depthtrack.errors import InputError
from depthtrack.geometry.camera import Camera
from depthtrack.recording.images import read_colour, read_packed
from depthtrack.recording.pickled_numbers import read_pickled_numbers
from depthtrack.recording.reading import ReadingOptions
from depthtrack.recording.sequence import GroundTruth
from depthtrack.recording.sequences.base import BaseSequence
from depthtrack.recording.sequences.numbered_files import first_size, has_file, nominal_times, numbered_files
from depthtrack.types import Array, Depth, Image

DEPTH_SCALE = 0.00012498664727900177
"""Metres per unit of the packed depth."""
FROM_MANO = (0, 13, 14, 15, 16, 1, 2, 3, 17, 4, 5, 6, 18, 10, 11, 12, 19, 7, 8, 9, 20)
"""Rows of `handJoints3D` in the order of our keypoints."""

_DEPTH, _META = re.compile(r"(\d+)\.png"), re.compile(r"(\d+)\.pkl")
_COLOUR = re.compile(r"(\d+)\.(?:jpg|png)")
_TO_CAMERA = np.array([1.0, -1.0, -1.0])
"""Factors from the frame of OpenGL to the camera frame."""


class Ho3dSequence(BaseSequence):
    """The frames of one sequence, with the joints that its annotations state."""

    format_name = "a folder with depth/0000.png and meta/0000.pkl (HO-3D)"

    def _open(self, camera: Camera | None) -> None:
        """See `BaseSequence`."""
        files = numbered_files(self.path / "depth", _DEPTH)
        self._numbers, self._files = list(files), list(files.values())
        self._colours = numbered_files(self.path / "rgb", _COLOUR) if has_file(self.path / "rgb", _COLOUR) else {}
        self.has_colour = any(number in self._colours for number in files)
        self.timestamps = nominal_times(self._numbers)
        self.description = {
            "data set": "HO-3D",
            "source": "Hampali et al., HOnnotate: a method for 3D annotation of hand and object poses, CVPR 2020",
        }
        annotations = {
            number: read_pickled_numbers(self.path / "meta" / name)
            for number, name in numbered_files(self.path / "meta", _META).items()
        }
        self.camera = camera or _camera(self.path, annotations)
        joints = {number: joints for number, fields in annotations.items() if (joints := _joints(fields)) is not None}
        if joints:
            self.ground_truth = GroundTruth(nominal_times(list(joints)), joints=np.array(list(joints.values())))

    @classmethod
    def matches(cls, path: Path) -> bool:
        """See `BaseSequence`."""
        return has_file(path / "meta", _META) and has_file(path / "depth", _DEPTH)

    @classmethod
    def image_size(cls, path: Path, reading: ReadingOptions | None = None) -> tuple[int, int]:
        """See `BaseSequence`."""
        return first_size(path / "depth", _DEPTH)

    def read_depth(self, index: int) -> Depth:
        """See `BaseSequence`."""
        packed = read_packed(self.path / "depth" / self._files[index], self.camera.shape).astype(np.uint16)
        return self.camera.metres(packed[..., 0] + 256 * packed[..., 1])

    def read_colour(self, index: int) -> Image | None:
        """See `BaseSequence`."""
        name = self._colours.get(self._numbers[index])
        return None if name is None else read_colour(self.path / "rgb" / name, self.camera.shape)


def _camera(path: Path, annotations: Mapping[int, Mapping[str, Any]]) -> Camera:
    """Return the camera of the first annotation that states it.

    Raises:
        InputError: if none does.
    """
    width, height = first_size(path / "depth", _DEPTH)
    for fields in annotations.values():
        K = fields.get("camMat")
        if isinstance(K, np.ndarray) and K.shape == (3, 3) and K.dtype.kind == "f":
            fx, fy, cx, cy = (float(K[row, column]) for row, column in ((0, 0), (1, 1), (0, 2), (1, 2)))
            return Camera(width, height, fx, fy, cx, cy, DEPTH_SCALE)
    raise InputError(
        f"{path / 'meta'} states no camMat of 3x3 numbers: give the camera with --camera FILE.json, or --fx and"
        f" --depth-scale {DEPTH_SCALE:.8f}"
    )


def _joints(fields: Mapping[str, Any]) -> Array | None:
    """Return the keypoints (21, 3) of an annotation, metres, camera frame; None without any.

    Of an evaluation sequence only the wrist is known, and the others are NaN.
    """
    found = fields.get("handJoints3D")
    if not isinstance(found, np.ndarray) or found.dtype.kind != "f" or found.shape not in ((21, 3), (3,), (1, 3)):
        return None
    joints = np.full((21, 3), np.nan)
    rows = found.reshape(-1, 3).astype(np.float64) * _TO_CAMERA
    joints[: len(rows)] = rows
    return joints[list(FROM_MANO)]
