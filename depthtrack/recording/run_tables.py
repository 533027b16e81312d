"""The CSV tables of a run folder: complete lines only, and bounds on what is read."""

import csv
import io
from collections.abc import Iterable, Sequence
from pathlib import Path

from depthtrack.errors import InputError
from depthtrack.files import read_lines, write_atomic

_LARGEST_TABLE = 1 << 29
"""Bytes: eight hours at 30 Hz, and a bound on memory."""


def header_of(path: Path) -> tuple[str, ...]:
    """Return the names in the first line of a table."""
    return tuple(next(read_lines(path, _LARGEST_TABLE), "").strip().split(","))


def read_table(path: Path, columns: Sequence[str] | None) -> list[list[str]]:
    """Return the complete lines of a table, without its header if `columns` is given.

    Raises:
        InputError: if it is no table, or one of other columns.
    """
    lines = [line for line in read_lines(path, _LARGEST_TABLE) if line.endswith("\n")]
    try:
        # No cell needs quotes, so a stray quote must not join the lines after it.
        header, *rows = list(csv.reader(lines, quoting=csv.QUOTE_NONE)) or [[]]
    except csv.Error as error:
        raise InputError(f"{path} must be a CSV table: {error}") from error
    if columns is None:
        return [header, *rows]
    if tuple(header) != tuple(columns):
        raise InputError(f"{path} must begin with the columns {', '.join(columns[:5])}...")
    # A row truncated inside its line break still has all its cells.
    if rows and len(rows[-1]) != len(columns):
        rows.pop()
    for number, cells in enumerate(rows, start=2):
        if len(cells) != len(columns):
            raise InputError(f"{path}, line {number}: expected {len(columns)} columns, found {len(cells)}")
    return rows


def rewrite_table(path: Path, columns: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Replace a table by these rows, or write none of them."""
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(columns)
    writer.writerows(rows)
    write_atomic(path, text.getvalue())
