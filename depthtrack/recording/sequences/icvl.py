"""A sequence of the ICVL hand posture data set: a folder of `image_0000.png` below `Depth`.

| file                       | content                                                                    |
|----------------------------|----------------------------------------------------------------------------|
| image_0000.png             | 16-bit depth, mm                                                           |
| labels.txt, test_seq_1.txt | beside `Depth`: name of an image and u v d (px, px, mm) of 16 joints; optional |

A name is relative to `Depth`, as `test_seq_1/image_0000.png`. The joints are the palm and the middles of the bones of
each finger, so none of them is a keypoint: runs are compared on the 16 joints.
Source: Tang et al., "Latent regression forest", CVPR 2014.
"""

import re
from pathlib import Path

import numpy as np

from depthtrack.errors import InputError
from depthtrack.files import open_regular, read_lines
from depthtrack.geometry.camera import Camera
from depthtrack.hand.benchmark_joints import BENCHMARKS
from depthtrack.number_text import parse_numbers
from depthtrack.recording.images import read_depth
from depthtrack.recording.reading import ReadingOptions
from depthtrack.recording.sequence import BenchmarkJoints, GroundTruth
from depthtrack.recording.sequences.base import BaseSequence
from depthtrack.recording.sequences.numbered_files import first_size, has_file, nominal_times, numbered_files
from depthtrack.types import Array, Depth

_IMAGE = re.compile(r"image_(\d+)\.png")
_LABEL = re.compile(r"\S*image_\d+\.png( +[-+.\deE]+){48}\s*")
_BENCHMARK = BENCHMARKS["icvl"]
_MAX_LABELS_BYTES = 1 << 28
_LEVELS = 4
"""Folders above the images in which labels are looked for: `Depth/201403121135/22-5` is the deepest."""


class IcvlSequence(BaseSequence):
    """A sequence of depth images, with joints if a label file above it names them."""

    format_name = "a folder with image_0000.png and labels above it (ICVL)"

    def _open(self, camera: Camera | None) -> None:
        """See `BaseSequence`."""
        self.camera = camera or _BENCHMARK.camera
        files = numbered_files(self.path, _IMAGE)
        self._files = list(files.values())
        self.timestamps = nominal_times(list(files))
        self.description = {"data set": "ICVL", "source": _BENCHMARK.source}
        labels = _labels(self.path.resolve())
        if labels:
            numbers = sorted(labels)
            uvd = np.array([labels[number] for number in numbers])
            depth = np.where(uvd[..., 2] > 0, uvd[..., 2] / 1000, np.nan)
            positions = _BENCHMARK.camera.unproject(uvd[..., :2], depth)
            self.ground_truth = GroundTruth(nominal_times(numbers), benchmark=BenchmarkJoints(_BENCHMARK, positions))

    @classmethod
    def matches(cls, path: Path) -> bool:
        """See `BaseSequence`."""
        return has_file(path, _IMAGE) and any(True for _ in _label_files(path.resolve()))

    @classmethod
    def image_size(cls, path: Path, reading: ReadingOptions | None = None) -> tuple[int, int]:
        """See `BaseSequence`."""
        return first_size(path, _IMAGE)

    def read_depth(self, index: int) -> Depth:
        """See `BaseSequence`."""
        return self.camera.metres(read_depth(self.path / self._files[index], self.camera.shape))


def _label_files(folder: Path) -> list[Path]:
    """Return the label files above a folder of images, by their first line."""
    found = []
    for above in list(folder.parents)[:_LEVELS]:
        for path in sorted(above.glob("*.txt")):
            try:
                with open_regular(path) as file:
                    first = file.readline(4096).decode()
            except (OSError, UnicodeDecodeError):
                continue
            if _LABEL.fullmatch(first):
                found.append(path)
    return found


def _labels(folder: Path) -> dict[int, Array]:
    """Return u v d (16, 3) of the images in a folder, by their number; empty without labels.

    Raises:
        InputError: if the line of an image is no 48 numbers.
    """
    found: dict[int, Array] = {}
    for path in _label_files(folder):
        prefix = f"{folder.name}/"
        if path.parent / "Depth" in folder.parents:
            prefix = f"{folder.relative_to(path.parent / 'Depth').as_posix()}/"
        for number, line in enumerate(read_lines(path, _MAX_LABELS_BYTES), start=1):
            if not line.startswith(prefix):
                continue
            name, *fields = line.removeprefix(prefix).split()
            match = _IMAGE.fullmatch(name)
            if match is None:
                continue
            try:
                row = np.array(parse_numbers(fields))
            except ValueError:
                row = np.zeros(0)
            if row.shape != (48,) or not np.all(np.abs(row) < 1e6):
                raise InputError(
                    f"{path}, line {number}: expected u v d of 16 joints after the image's name, found"
                    f" {len(fields)} fields"
                )
            found[int(match[1])] = row.reshape(16, 3)
        if found:
            return found
    return found
