"""A recording of one camera of DexYCB.

Its folder is `20200709-subject-01/20200709_141754/836212060125`.

| file                                 | content                                                      |
|--------------------------------------|--------------------------------------------------------------|
| aligned_depth_to_color_000000.png    | 16-bit depth, mm, in the pixels of the colour camera         |
| color_000000.jpg                     | colour; optional                                             |
| labels_000000.npz                    | `joint_3d` (1, 21, 3) m, `seg` (h, w) with 255 = hand; optional |
| calibration/intrinsics/NUMBER_640x480.yml | in a folder above: `color` with fx, fy, ppx, ppy        |

Joints are the 21 keypoints in our order; all of them are -1 if the hand is not seen.
Source: Chao et al., "DexYCB: a benchmark for capturing hand grasping of objects", CVPR 2021.
"""

import re
from glob import escape
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthtrack.errors import DamagedFrameError, InputError
from depthtrack.files import read_text
from depthtrack.geometry.camera import Camera
from depthtrack.number_text import parse_number
from depthtrack.recording.images import read_colour, read_depth
from depthtrack.recording.numpy_arrays import read_arrays
from depthtrack.recording.reading import ReadingOptions
from depthtrack.recording.sequence import GroundTruth
from depthtrack.recording.sequences.base import BaseSequence
from depthtrack.recording.sequences.numbered_files import first_size, has_file, nominal_times, numbered_files
from depthtrack.types import Depth, Image, Mask

_DEPTH = re.compile(r"aligned_depth_to_color_(\d{6})\.png")
_COLOUR, _LABELS = re.compile(r"color_(\d{6})\.jpg"), re.compile(r"labels_(\d{6})\.npz")
_HAND = 255
"""Value of the hand in `seg`."""
_MAX_ARRAY_BYTES = 1 << 26
_DATASET = "DexYCB"


class DexYcbSequence(BaseSequence):
    """The frames of one camera, with joints and masks if there are labels."""

    format_name = "a folder with aligned_depth_to_color_000000.png (DexYCB)"

    def _open(self, camera: Camera | None) -> None:
        """See `BaseSequence`."""
        self.camera = camera or _read_camera(self.path.resolve())
        files = numbered_files(self.path, _DEPTH)
        self._numbers, self._files = list(files), list(files.values())
        self._colours = numbered_files(self.path, _COLOUR) if has_file(self.path, _COLOUR) else {}
        self._labels = numbered_files(self.path, _LABELS) if has_file(self.path, _LABELS) else {}
        self.has_colour = any(number in self._colours for number in files)
        self.timestamps = nominal_times(self._numbers)
        self.description = {
            "data set": _DATASET,
            "source": "Chao et al., DexYCB: a benchmark for capturing hand grasping of objects, CVPR 2021",
        }
        if self._labels:
            joints = [_joints(self.path / name) for name in self._labels.values()]
            self.ground_truth = GroundTruth(nominal_times(list(self._labels)), joints=np.array(joints))

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
        return self.camera.metres(read_depth(self.path / self._files[index], self.camera.shape))

    def read_colour(self, index: int) -> Image | None:
        """See `BaseSequence`."""
        name = self._colours.get(self._numbers[index])
        return None if name is None else read_colour(self.path / name, self.camera.shape)

    def hand_mask(self, index: int) -> Mask | None:
        """See `Sequence`.

        Raises:
            DamagedFrameError: if the labels of the frame exist and have no mask of the image's size.
        """
        name = self._labels.get(self._numbers[index])
        if name is None:
            return None
        mask = _array(self.path / name, "seg")
        if mask.shape != self.camera.shape:
            raise DamagedFrameError(f"{self.path / name}: seg must be {self.camera.shape}, found {mask.shape}")
        return np.asarray(mask == _HAND)


def _read_camera(folder: Path) -> Camera:
    """Return the colour camera, whose pixels the depth has.

    Raises:
        InputError: if no calibration is in a folder above.
    """
    for above in folder.parents:
        for path in sorted((above / "calibration" / "intrinsics").glob(f"{escape(folder.name)}_*x*.yml")):
            if size := re.fullmatch(r".*_(\d{1,4})x(\d{1,4})\.yml", path.name):
                return _parsed_camera(path, int(size[1]), int(size[2]))
    raise InputError(
        f"no folder above {folder} has calibration/intrinsics/{folder.name}_640x480.yml: keep the folders of DexYCB, or"
        " give the camera with --camera FILE.json, or --fx and --depth-scale"
    )


def _parsed_camera(path: Path, width: int, height: int) -> Camera:
    block = re.search(r"^color:(.*?)(?=^\S|\Z)", read_text(path), re.DOTALL | re.MULTILINE)
    found = dict(re.findall(r"\b(fx|fy|ppx|ppy):\s*([-+.\deE]+)", block[1] if block else ""))
    try:
        fx, fy, cx, cy = (parse_number(found[name]) for name in ("fx", "fy", "ppx", "ppy"))
    except (KeyError, ValueError) as error:
        raise InputError(f"{path} must hold fx, fy, ppx and ppy below color, found {sorted(found)}") from error
    return Camera(width, height, fx, fy, cx, cy, 0.001)


def _joints(path: Path) -> NDArray[np.float64]:
    """Return the keypoints (21, 3), metres; NaN if the hand is not seen."""
    joints = _array(path, "joint_3d")
    if joints.shape != (1, 21, 3):
        raise InputError(f"{path}: joint_3d must be (1, 21, 3), found {joints.shape}")
    seen = np.isfinite(joints).all() and not (joints == -1).all()
    return joints[0].astype(np.float64) if seen else np.full((21, 3), np.nan)


def _array(path: Path, name: str) -> NDArray[Any]:
    """Return an array of a NumPy archive, without pickles.

    Raises:
        DamagedFrameError: if it is missing, damaged, or holds no numbers.
    """
    array = read_arrays(path, (name,), _MAX_ARRAY_BYTES).get(name)
    if array is None or array.dtype.kind not in "biuf":
        raise DamagedFrameError(f"{path}: {name} must hold numbers, found {'none' if array is None else array.dtype}")
    return array
