"""Lines and rows of numbers in text files of captures."""

import math
from array import array
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path
from typing import Self

import numpy as np

from depthtrack.errors import InputError
from depthtrack.files import check_size, open_regular
from depthtrack.markers.formats.stored_capture import FARTHEST, MAX_SAMPLES, check_dimensions
from depthtrack.number_text import parse_number, parse_numbers
from depthtrack.types import Array, Index

MAX_BYTES = 1 << 31
"""Largest text file read."""
_BLANKS = ("", "nan", "-nan")
"""Texts in cells of gaps, in lower case."""
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
    with open_regular(path) as file:
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


@dataclass(frozen=True)
class Columns:
    """What the cells of a row hold.

    width: largest number of cells; those after the last column that is read may be missing.
    coordinates: (M,) cell of x of each trajectory; those of y and z follow it.
    frame, time: cells of the frame's number and its time in seconds, if any.
    """

    width: int
    coordinates: tuple[int, ...]
    frame: int | None = None
    time: int | None = None

    @classmethod
    def plain(cls, keys: tuple[str, ...], trajectories: int) -> Self:
        """Return the columns of rows of `keys`, of "frame" and "time", and coordinates."""
        first = len(keys)
        columns = {name: column for column, name in enumerate(keys)}
        coordinates = tuple(range(first, first + 3 * trajectories, 3))
        return cls(first + 3 * trajectories, coordinates, columns.get("frame"), columns.get("time"))

    @property
    def keys(self) -> tuple[int, ...]:
        """Cells that must not be blank."""
        return tuple(column for column in (self.frame, self.time) if column is not None)


@dataclass(frozen=True, eq=False)
class Rows:
    """The rows of numbers below a header.

    points: (T, M, 3) coordinates; NaN in blank cells.
    lines: (T,) line of each row.
    frames, times: (T,) as stated; None if the rows have none.
    """

    points: Array
    lines: Index
    frames: Array | None = None
    times: Array | None = None


def read_rows(lines: Iterable[Line], separator: str, columns: Columns, path: Path) -> Rows:
    """Return the rows of lines. Blank lines are passed over.

    Raises:
        InputError: if a cell is no number, cells are missing or too many, or there are too many rows or none.
    """
    trajectories = len(columns.coordinates)
    check_dimensions(1, trajectories, str(path))
    chosen = (*columns.keys, *(first + axis for first in columns.coordinates for axis in range(3)))
    select, least = itemgetter(*chosen), max(chosen) + 1
    values, places = array("d"), array("q")
    for number, line in lines:
        if not line.strip(separator + " \t\r"):
            continue
        where = f"{path}, line {number}"
        cells = _cells(line, separator, least, columns.width, where)
        try:
            found = parse_numbers(select(cells))
        except ValueError:
            found = [_number(cells[column], column, where) for column in chosen]
        values.extend(found)
        places.append(number)
        if len(places) * trajectories > MAX_SAMPLES:
            check_dimensions(len(places), trajectories, where)
    check_dimensions(len(places), trajectories, str(path))
    table, line_numbers = np.frombuffer(values).reshape(-1, len(chosen)), np.frombuffer(places, dtype=np.int64)
    keys = len(columns.keys)
    wrong = np.argwhere((np.abs(table) > FARTHEST) | (np.isnan(table) & (np.arange(len(chosen)) < keys)))
    if len(wrong):
        row, column = wrong[0]
        place, found = f"{path}, line {line_numbers[row]}, cell {chosen[column] + 1}", table[row, column]
        raise InputError(f"{place}: expected a number below {FARTHEST:g}, found {found:g}")
    frames = None if columns.frame is None else table[:, 0]
    times = None if columns.time is None else table[:, keys - 1]
    return Rows(table[:, keys:].reshape(len(table), trajectories, 3), line_numbers, frames, times)


def positive_number(text: str, what: str) -> float:
    """Return a number above 0 of a header; `what` has its place. Raises InputError."""
    value = _float(text)
    if not 0 < value < FARTHEST:
        raise InputError(f"{what} must be a number above 0, found {text[:40]!r}")
    return value


def whole_number(text: str, what: str) -> int:
    """Return a whole number above 0 of a header; `what` has its place. Raises InputError."""
    value = positive_number(text, what)
    if value != int(value):
        raise InputError(f"{what} must be a whole number, found {text[:40]!r}")
    return int(value)


def is_number(text: str) -> bool:
    """Return whether a cell has a number; NaN is one."""
    return text.strip().lower() == "nan" or not math.isnan(_float(text))


def count_note(what: str, stated: str, found: int) -> tuple[str, ...]:
    """Return a note if a header states another count than the file has."""
    return () if _float(stated) == found else (f"the header states {stated[:20]!r} {what}, the file has {found}",)


def _cells(line: str, separator: str, least: int, width: int, where: str) -> list[str]:
    cells = line.split(separator, width + 1)
    while len(cells) > width and not cells[-1].strip():
        cells.pop()
    if not least <= len(cells) <= width:
        raise InputError(f"{where}: expected {width} cells as in the header, found {line.count(separator) + 1}")
    return cells


def _number(cell: str, column: int, where: str) -> float:
    """Return the number in a cell, NaN if it is blank. Raises InputError."""
    value = _float(cell)
    if math.isnan(value) and cell.strip().lower() not in _BLANKS:
        raise InputError(f"{where}, cell {column + 1}: expected a number or a blank, found {cell.strip()[:40]!r}")
    return value


def _float(text: str) -> float:
    try:
        return parse_number(text)
    except ValueError:
        return math.nan
