"""The image lists of a TUM RGB-D folder, also as other tools write them.

A line holds `timestamp filename`. A line of an association list holds two such pairs, colour and depth in any order.
Tabs, commas and semicolons separate as blanks do.
Source: Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems", IROS 2012.
"""

import math
import os
import re
from bisect import bisect_left
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from depthtrack.errors import InputError
from depthtrack.files import read_lines
from depthtrack.number_text import parse_number
from depthtrack.recording.sequences.inside import Inside
from depthtrack.types import Array

MAX_FRAMES = 1_000_000
"""Largest number of images in a list: nine hours at 30 Hz."""
MAX_LIST_BYTES = 1 << 26
"""Largest list file read, a bound on memory that allows for `MAX_FRAMES` lines."""

_SEPARATORS = re.compile(r"\s*[,;\t]\s*")
_DECIMAL_COMMA = re.compile(r"\s*(\d+),(\d+)[;\s]+([^\d\s,;].*)")
_HEADING = re.compile(r"[A-Za-z_ ,;\t\[\]()\"']+")
_LEFT_OUT_SHOWN = 3


@dataclass(frozen=True, slots=True)
class ListedFile:
    """One image of a list.

    timestamp: as stored, in any unit.
    name: file within the folder.
    line: number of its line, from 1.
    """

    timestamp: float
    name: str
    line: int


@dataclass(frozen=True)
class ImageList:
    """The images of one kind.

    path: the list, or the folder that was listed in its place.
    files: in the order of the list.
    whole: whether all times are written without a decimal point.
    left_out: lines that are left out, because their times do not increase.
    """

    path: Path
    files: list[ListedFile]
    whole: bool
    left_out: int = 0

    @property
    def times(self) -> Array:
        """Stored times (N,), in any unit."""
        return np.array([file.timestamp for file in self.files], dtype=np.float64)

    def increasing(self) -> "ImageList":
        """Return the list without the fewest lines whose times do not increase."""
        kept = _longest_increasing([file.timestamp for file in self.files])
        return replace(self, files=[self.files[i] for i in kept], left_out=len(self.files) - len(kept))

    def check_increasing(self) -> None:
        """Raise InputError at the first time that does not increase."""
        for earlier, file in zip(self.files, self.files[1:], strict=False):
            if file.timestamp > earlier.timestamp:
                continue
            rounded = f"{file.timestamp:.6g}" == f"{earlier.timestamp:.6g}" and not self.whole
            cause = "write more digits if the times were rounded" if rounded else "sort the list by time"
            raise InputError(
                f"{self.path}, line {file.line}: timestamps must increase, found {file.timestamp} after"
                f" {earlier.timestamp}: {cause}, leave such lines out with --on-damage skip,"
                " or ignore the times with --time-unit index"
            )


def read_list(path: Path) -> ImageList:
    """Return the images of `depth.txt` or `rgb.txt`, without a check that the files exist.

    Raises:
        InputError: if a line is malformed, or a file lies outside the folder.
    """
    return images_of(path, _read(path, 1)[0])


def read_associations(path: Path) -> tuple[ImageList, ImageList]:
    """Return the first and the second images of an association list.

    Raises:
        InputError: as `read_list`.
    """
    first, second = _read(path, 2)
    return images_of(path, first), images_of(path, second)


def columns_of(path: Path) -> int:
    """Return the number of images in the first line of a list, 1 or 2; 1 without any line."""
    first = next(_content(path), None)
    return 2 if first is not None and len(_pairs(first[1])) == 2 else 1


def images_of(path: Path, images: list[tuple[str, str, int]]) -> ImageList:
    """Return the list of (time, name, number of the line) in a folder. Raises InputError."""
    inside = Inside(path if path.is_dir() else path.parent)
    files: list[ListedFile] = []
    whole = True
    for text, name, line in images:
        where = f"{path}, line {line}" if os.path.isfile(path) else str(path)
        if not inside.holds(name):
            raise InputError(
                f"{where}: the file {name!r:.80} must lie within the folder of the recording:"
                " write its name from there, as in depth/0001.png"
            )
        if len(files) == MAX_FRAMES:
            raise InputError(f"{path} lists more than {MAX_FRAMES:,} images: split the recording")
        whole = whole and text.lstrip("+-").isdigit()
        files.append(ListedFile(parse_number(text), name, line))
    return ImageList(path, files, whole)


def _read(path: Path, images: int) -> list[list[tuple[str, str, int]]]:
    """Return (time, name, number of the line) of the images of each column."""
    columns: list[list[tuple[str, str, int]]] = [[] for _ in range(images)]
    for number, line in _content(path):
        pairs = _pairs(line)
        if len(pairs) < images or not all(_is_time(time) and name for time, name in pairs):
            expected = "'timestamp filename'" if images == 1 else "'timestamp filename timestamp filename'"
            raise InputError(
                f"{path}, line {number}: expected {expected} with the time in seconds, found {line.strip()[:80]!r}"
            )
        for column, (time, name) in zip(columns, pairs, strict=False):
            column.append((time, name.replace("\\", "/").removeprefix("./"), number))
    return columns


def _content(path: Path) -> Iterator[tuple[int, str]]:
    """Yield number and text of the lines without comments, empty lines and a heading."""
    before = True
    for number, line in enumerate(read_lines(path, MAX_LIST_BYTES), start=1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        if not (before and _HEADING.fullmatch(line.strip()) and len(_fields(line)) > 1):
            yield number, line
        before = False


def _pairs(line: str) -> list[tuple[str, str]]:
    """Return (time, name) of the images of a line; the name may precede the time."""
    fields = _fields(line)
    if len(fields) == 4 and _is_time(fields[2]) and not _is_time(fields[1]):
        return [(fields[0], fields[1]), (fields[2], fields[3])]
    if len(fields) >= 2 and not _is_time(fields[0]) and _is_time(fields[1]):
        return [(fields[1], fields[0])]
    if _SEPARATORS.search(line.strip()) or len(fields) < 2:
        return [(fields[0], fields[1] if len(fields) > 1 else "")]
    time, name = line.split(maxsplit=1)
    return [(time, name.strip())]


def _fields(line: str) -> list[str]:
    if (comma := _DECIMAL_COMMA.fullmatch(line.rstrip())) is not None:
        return [f"{comma[1]}.{comma[2]}", comma[3]]
    text = line.strip()
    parts = _SEPARATORS.split(text) if _SEPARATORS.search(text) else text.split()
    return [part.strip("\"'") for part in parts]


def _is_time(text: str) -> bool:
    try:
        return math.isfinite(parse_number(text))
    except ValueError:
        return False


def _longest_increasing(times: list[float]) -> list[int]:
    """Return the indices of a longest strictly increasing subsequence (patience sorting)."""
    tails: list[float] = []
    ends: list[int] = []
    previous: list[int] = []
    for index, time in enumerate(times):
        place = bisect_left(tails, time)
        previous.append(ends[place - 1] if place else -1)
        if place == len(tails):
            tails.append(time)
            ends.append(index)
        else:
            tails[place], ends[place] = time, index
    chain: list[int] = []
    index = ends[-1] if ends else -1
    while index >= 0:
        chain.append(index)
        index = previous[index]
    return chain[::-1]
