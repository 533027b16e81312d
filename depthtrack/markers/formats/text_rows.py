"""Lines and rows of numbers in text files of captures."""

import math
from array import array
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from depthtrack.errors import InputError
from depthtrack.files import check_size
from depthtrack.markers.formats.stored_capture import FARTHEST, MAX_SAMPLES, check_dimensions
from depthtrack.types import Array, Index

MAX_BYTES = 1 << 31
"""Largest text file read."""
_LONGEST_LINE = 1 << 23
"""Bytes of a line at most: 65,535 trajectories with 40 bytes a number."""

Line = tuple[int, str]
"""A line's number from 1, and its text without the end of line."""


def text_lines(path: Path) -> Iterator[Line]:
    """Yield the lines of a text file; bytes that are not UTF-8 are read as Latin-1.

    Raises:
        InputError: if the file is missing, too long, or holds a line that is too long or binary.
    """
    check_size(path, MAX_BYTES)
    with path.open("rb") as file:
        number = 0
        while line := file.readline(_LONGEST_LINE + 1):
            number += 1
            where = f"{path}, line {number}"
            if len(line) > _LONGEST_LINE:
                raise InputError(f"{where}: a line must have at most {_LONGEST_LINE:,} bytes")
            if b"\0" in line:
                raise InputError(f"{where}: expected text, found a zero byte")
            yield number, decoded(line.removeprefix(b"\xef\xbb\xbf") if number == 1 else line).rstrip("\r\n")


def decoded(line: bytes) -> str:
    """Return bytes as text: UTF-8, else Latin-1."""
    try:
        return line.decode()
    except UnicodeDecodeError:
        return line.decode("latin-1")


@dataclass(frozen=True, eq=False)
class Rows:
    """The rows of numbers below a header.

    keys: (T, K) of the K leading cells, such as frame and time.
    points: (T, M, 3) coordinates; NaN in blank cells.
    lines: (T,) line of each row.
    """

    keys: Array
    points: Array
    lines: Index


def read_rows(lines: Iterable[Line], separator: str, key_count: int, trajectories: int, path: Path) -> Rows:
    """Return rows of `key_count` leading cells and three coordinates a trajectory. Blank lines are passed over.

    Raises:
        InputError: if a cell is no number, cells are missing or too many, or there are too many rows or none.
    """
    width = key_count + 3 * trajectories
    values, places = array("d"), array("q")
    check_dimensions(1, trajectories, str(path))
    for number, line in lines:
        if not line.strip(separator + " \t\r"):
            continue
        values.extend(_numbers(line, separator, width, key_count, f"{path}, line {number}"))
        places.append(number)
        if len(places) * trajectories > MAX_SAMPLES:
            check_dimensions(len(places), trajectories, f"{path}, line {number}")
    check_dimensions(len(places), trajectories, str(path))
    table, line_numbers = np.frombuffer(values).reshape(-1, width), np.frombuffer(places, dtype=np.int64)
    wrong = np.argwhere(np.abs(table) > FARTHEST)
    if len(wrong):
        row, column = wrong[0]
        raise InputError(
            f"{path}, line {line_numbers[row]}, cell {column + 1}: expected a number below {FARTHEST:g},"
            f" found {table[row, column]:g}"
        )
    return Rows(table[:, :key_count], table[:, key_count:].reshape(len(table), trajectories, 3), line_numbers)


@dataclass(frozen=True, eq=False)
class Timing:
    """The frames of rows.

    frames: (T,) place of each row, from 0; places without a row are gaps.
    rate: Hz; None if unknown.
    first_frame: number of the first frame.
    notes: on missing rows.
    """

    frames: Index
    rate: float | None
    first_frame: int
    notes: tuple[str, ...]

    def spread(self, points: Array) -> Array:
        """Return points (T, M, 3) with rows of NaN where frames are missing."""
        count = int(self.frames[-1]) + 1
        if count == len(points):
            return points
        complete = np.full((count, *points.shape[1:]), np.nan)
        complete[self.frames] = points
        return complete


def timing(
    rows: Rows, path: Path, frame: int | None = None, time: int | None = None, rate: float | None = None
) -> Timing:
    """Return the timing that rows state.

    frame, time: columns of `rows.keys` with the frame's number and its time in seconds, if any.
    rate: Hz, as the header states it; otherwise that of the median interval.

    Raises:
        InputError: if frames or times do not increase, or would leave more gaps than a capture may have frames.
    """
    times = None if time is None else rows.keys[:, time]
    if times is not None:
        _check_increase(times, rows.lines, path, "times")
        if rate is None and len(times) > 1:
            rate = 1 / float(np.median(np.diff(times)))
    if frame is not None:
        numbers = rows.keys[:, frame]
        _check_increase(numbers, rows.lines, path, "frames")
        if np.any(numbers != np.floor(numbers)):
            line = rows.lines[np.argmax(numbers != np.floor(numbers))]
            raise InputError(f"{path}, line {line}: expected the whole number of a frame in the first cell")
    elif times is not None and rate is not None:
        numbers = np.round((times - times[0]) * rate) + 1
        _check_increase(numbers, rows.lines, path, "times at a constant rate")
    else:
        numbers = np.arange(1.0, len(rows.points) + 1)
    places = (numbers - numbers[0]).astype(np.int64)
    check_dimensions(int(places[-1]) + 1, rows.points.shape[1], str(path))
    missing = int(places[-1]) + 1 - len(places)
    notes = (f"{missing} frames have no row in the file and are gaps",) if missing else ()
    return Timing(places, rate, int(numbers[0]), notes)


def positive_number(text: str, what: str) -> float:
    """Return the number of a header, such as a rate; `what` has its place. Raises InputError unless it is above 0."""
    value = _float(text)
    if not 0 < value < FARTHEST:
        raise InputError(f"{what} must be a number above 0, found {text[:40]!r}")
    return value


def whole_number(text: str, what: str) -> int:
    """Return the whole number of a header; `what` has its place. Raises InputError unless it is above 0."""
    value = positive_number(text, what)
    if value != int(value):
        raise InputError(f"{what} must be a whole number, found {text[:40]!r}")
    return int(value)


def is_number(text: str) -> bool:
    """Return whether a cell has a number; NaN is one."""
    return text.strip().lower() == "nan" or not math.isnan(_float(text))


def count_note(what: str, stated: str, found: int) -> tuple[str, ...]:
    """Return a note if a header states another count than the file has."""
    return () if _float(stated) == found else (f"the header states {stated[:20]} {what}, the file has {found}",)


def _numbers(line: str, separator: str, width: int, key_count: int, where: str) -> list[float]:
    cells = line.split(separator, width + 1)
    while len(cells) > width and not cells[-1].strip():
        cells.pop()
    if len(cells) != width:
        raise InputError(f"{where}: expected {width} cells as in the header, found {line.count(separator) + 1}")
    if "_" not in line:
        try:
            numbers = list(map(float, cells))
            if not any(map(math.isnan, numbers[:key_count])):
                return numbers
        except ValueError:
            pass
    return [_number(cell, column < key_count, f"{where}, cell {column + 1}") for column, cell in enumerate(cells)]


def _number(cell: str, required: bool, where: str) -> float:
    """Return the number in a cell, NaN if it is blank. Raises InputError."""
    value = _float(cell)
    blank = cell.strip().lower() in ("", "nan", "-nan")
    if math.isnan(value) and (required or not blank):
        raise InputError(f"{where}: expected a number{'' if required else ' or a blank'}, found {cell.strip()[:40]!r}")
    return value


def _float(text: str) -> float:
    try:
        return math.nan if "_" in text else float(text)
    except ValueError:
        return math.nan


def _check_increase(values: Array, lines: Index, path: Path, what: str) -> None:
    falls = np.flatnonzero(np.diff(values) <= 0)
    if len(falls):
        row = falls[0] + 1
        raise InputError(
            f"{path}, line {lines[row]}: {what} must increase, found {values[row]:.10g} after {values[row - 1]:.10g}"
        )
