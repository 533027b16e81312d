"""TSV of Qualisys Track Manager: names and values, then a row a frame, in millimetres.

Source: QTM user manual, "TSV file formats", motion data.
"""

from dataclasses import dataclass
from itertools import chain
from pathlib import Path

from depthtrack.errors import InputError
from depthtrack.markers.formats.stored_capture import CaptureFormat, StoredCapture
from depthtrack.markers.formats.text_rows import (
    Columns,
    Line,
    count_note,
    is_number,
    positive_number,
    read_rows,
    text_lines,
    whole_number,
)
from depthtrack.markers.formats.timing import timing

_LONGEST_HEADER = 100
"""Lines before the numbers, at most."""
_NAMES = "MARKER_NAMES"


def matches(head: bytes) -> bool:
    """Return whether the file begins as such a header does."""
    return head.startswith((b"NO_OF_FRAMES\t", b"NO_OF_CAMERAS\t", b"NO_OF_MARKERS\t"))


def read(path: Path) -> StoredCapture:
    """Read a file.

    Raises:
        InputError: if it is damaged, or holds no 3D data; the message states the line.
    """
    lines = text_lines(path)
    header = _Header(path, {}, ())
    for line in lines:
        number, text = line
        cells = [cell.strip() for cell in text.split("\t")]
        if _NAMES in header.values and is_number(next(filter(None, cells), "")):
            return _read_rows(header, chain([line], lines))
        if cells[0].lower().startswith("frame"):
            names = [cell.lower().rstrip("#") for cell in cells[:2]]
            header = _Header(path, header.values, tuple(names[: 2 if names[1:] == ["time"] else 1]))
        header.values.setdefault(cells[0], (number, cells[1:]))
        if number > _LONGEST_HEADER:
            break
    what = "a row of numbers" if _NAMES in header.values else f"a line {_NAMES}"
    raise InputError(f"{path}: expected {what} within the first {_LONGEST_HEADER} lines, found none")


@dataclass(frozen=True)
class _Header:
    """The line and the values of each key, and the names of the columns before the coordinates."""

    path: Path
    values: dict[str, tuple[int, list[str]]]
    columns: tuple[str, ...]

    def first(self, key: str, default: str = "") -> tuple[str, str]:
        """Return the first value of a key, and where it stands."""
        number, cells = self.values.get(key, (1, []))
        return (cells[0] if cells else default), f"{self.path}, line {number}: {key}"


def _read_rows(header: _Header, lines: "chain[Line]") -> StoredCapture:
    kind, where = header.first("DATA_INCLUDED", "3D")
    if kind != "3D":
        raise InputError(f"{where} must be 3D, found {kind[:40]!r}: export the 3D data")
    rate = positive_number(*header.first("FREQUENCY"))
    labels = header.values[_NAMES][1]
    count = whole_number(*header.first("NO_OF_MARKERS", str(len(labels))))
    while len(labels) > count and not labels[-1]:
        labels.pop()
    rows = read_rows(lines, "\t", Columns.plain(header.columns, count), header.path)
    clock = timing(rows, header.path, rate)
    stated = header.first("NO_OF_FRAMES", str(len(rows.points)))[0]
    notes = (*count_note("frames", stated, len(rows.points)), *clock.notes)
    return StoredCapture(tuple(labels), clock.spread(rows.points), clock.rate, "mm", None, clock.first_frame, notes)


FORMAT = CaptureFormat("Qualisys TSV", (".tsv",), matches, read)
