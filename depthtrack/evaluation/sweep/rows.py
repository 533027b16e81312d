"""Journal of a sweep: one JSON object per line, readable after a kill at any time."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from depthtrack.closing import Closing
from depthtrack.errors import InputError
from depthtrack.files import check_size
from depthtrack.strict_data import json_text, parse_json

Cell = dict[str, Any]
"""Parameters of one measurement: plain JSON values by name."""

_LARGEST = 1 << 28
"""Bytes of a journal at most."""

Row = dict[str, Any]
"""A cell and its measured values: plain JSON values by name; None for a value that is not finite."""


class Journal(Closing):
    """Rows on disk. A row belongs to a cell if all values of the cell are equal."""

    def __init__(self, path: Path, names: Sequence[str]) -> None:
        """Open or create the file; an incomplete last line is dropped.

        names: keys of all cells.

        Raises:
            InputError: if it is no regular file, or a line is no JSON object.
        """
        self._names, self._rows = tuple(names), dict[str, Row]()
        path.parent.mkdir(parents=True, exist_ok=True)
        if os.path.lexists(path):
            check_size(path, _LARGEST)
        self._file = path.open("a+b")
        self._file.seek(0)
        whole, line_break, cut = self._file.read().rpartition(b"\n")
        if cut:
            self._file.truncate(len(whole) + len(line_break))
        for number, line in enumerate(whole.splitlines(), start=1):
            row = _parse(line)
            if row is None:
                self._file.close()
                raise InputError(f"{path}, line {number}: expected a JSON object: correct the line or remove the file")
            self._rows[self._key(row)] = row

    def get(self, cell: Cell) -> Row | None:
        """Return the row of a cell; None without one."""
        return self._rows.get(self._key(cell))

    def append(self, row: Row) -> None:
        """Add a row and flush it to the operating system."""
        self._file.write(json_text(row).encode() + b"\n")
        self._file.flush()
        # The round trip turns tuples into lists and NaN into None, as in the file.
        self._rows[self._key(row)] = parse_json(json_text(row))

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _key(self, row: Row) -> str:
        return json_text([row.get(name) for name in self._names])


def _parse(line: bytes) -> Row | None:
    try:
        row = parse_json(line)
    except ValueError:
        return None
    return row if isinstance(row, dict) else None
