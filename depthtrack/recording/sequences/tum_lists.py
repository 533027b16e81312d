"""The image lists of a TUM RGB-D folder, and the association of two of them.

A line holds `timestamp filename`.
Source: Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems", IROS 2012.
"""

import math
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from depthtrack.errors import InputError
from depthtrack.files import read_lines

MAX_FRAMES = 1_000_000
"""Largest number of images in a list: nine hours at 30 Hz."""
MAX_LIST_BYTES = 1 << 26
"""Largest list file read, a bound on memory that allows for `MAX_FRAMES` lines."""
MAX_COLOUR_DELAY = 0.02
"""Largest difference of timestamps, seconds, between associated depth and colour images."""


@dataclass(frozen=True, slots=True)
class ListedFile:
    """One line of a list: the timestamp (seconds) and the file's name within the folder."""

    timestamp: float
    name: str


def read_list(folder: Path, list_name: str) -> list[ListedFile]:
    """Return the lines of `depth.txt` or `rgb.txt`, without a check that the files exist.

    Raises:
        InputError: if no image is listed, timestamps do not increase, or a file lies outside `folder`.
    """
    path = folder / list_name
    files: list[ListedFile] = []
    inside = _Inside(folder)
    for number, line in enumerate(read_lines(path, MAX_LIST_BYTES), start=1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        file = _parse(line, f"{path}, line {number}")
        if files and file.timestamp <= files[-1].timestamp:
            raise InputError(
                f"{path}, line {number}: timestamps must increase, found {file.timestamp} after {files[-1].timestamp}:"
                " sort the list by time and drop double entries"
            )
        if not inside.holds(file.name):
            raise InputError(
                f"{path}, line {number}: the file {file.name!r} must lie within the folder of the recording"
            )
        if len(files) == MAX_FRAMES:
            raise InputError(f"{path} lists more than {MAX_FRAMES:,} images: split the recording")
        files.append(file)
    if not files:
        raise InputError(f"{path} lists no image: expected lines of the form 'timestamp filename'")
    return files


def associate(depth: ArrayLike, colour: ArrayLike, max_difference: float = MAX_COLOUR_DELAY) -> dict[int, int]:
    """Return the nearest colour image of each depth image that has one within `max_difference`.

    `depth` (D,) and `colour` (C,) are strictly increasing timestamps in seconds. Of two equally near colour images the
    earlier one is taken. Unlike in TUM's associate.py, a colour image may serve two depth images: with cameras half a
    period apart, a one-to-one association leaves up to a third of the depth images without colour.
    """
    times, candidates = np.asarray(depth, dtype=np.float64), np.asarray(colour, dtype=np.float64)
    if not len(candidates):
        return {}
    after = np.searchsorted(candidates, times).clip(0, len(candidates) - 1)
    before = np.maximum(after - 1, 0)
    nearest = np.where(times - candidates[before] <= candidates[after] - times, before, after)
    rows = np.flatnonzero(np.abs(candidates[nearest] - times) < max_difference)
    return dict(zip(rows.tolist(), nearest[rows].tolist(), strict=True))


def _parse(line: str, where: str) -> ListedFile:
    fields = line.split(maxsplit=1)
    try:
        timestamp = float(fields[0])
    except ValueError:
        timestamp = math.nan
    if len(fields) != 2 or not math.isfinite(timestamp):
        raise InputError(f"{where}: expected 'timestamp filename' with the time in seconds, found {line[:80]!r}")
    return ListedFile(timestamp, fields[1].strip())


class _Inside:
    """Checks that a listed name lies within a folder; follows the links of each directory once.

    It works on strings: a list has one name per frame, and path objects would take longer than reading the list.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = str(folder)
        self._root = Path(os.path.realpath(folder))
        self._directories: dict[str, bool] = {}

    def holds(self, name: str) -> bool:
        # Backslashes and drive letters leave the folder on Windows; control characters could steer a terminal.
        if (
            name.startswith("/")
            or name[1:2] == ":"
            or "\\" in name
            or ".." in name.split("/")
            or not name.isprintable()
        ):
            return False
        directory = name.rpartition("/")[0]
        if directory not in self._directories:
            self._directories[directory] = self._leads_inside(directory)
        is_link = os.path.islink(f"{self._folder}/{name}")
        return self._directories[directory] and (not is_link or self._leads_inside(name))

    def _leads_inside(self, name: str) -> bool:
        return Path(os.path.realpath(f"{self._folder}/{name}")).is_relative_to(self._root)


def is_inside(folder: Path, name: str) -> bool:
    """Return whether the file `name` of `folder` lies within it, links followed."""
    return _Inside(folder).holds(name)
