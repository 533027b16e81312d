"""CSV of OptiTrack Motive: names and values, rows that describe the columns, a row a frame.

Source: OptiTrack documentation, "Data Export: CSV".
"""

from collections.abc import Iterator
from itertools import islice, pairwise
from pathlib import Path

from depthtrack.errors import InputError
from depthtrack.markers.formats.stored_capture import CaptureFormat, StoredCapture
from depthtrack.markers.formats.text_rows import Columns, Line, is_number, positive_number, read_rows, text_lines
from depthtrack.markers.formats.timing import timing

_MEASURED = ("Marker",)
_SOLVED = ("Rigid Body Marker", "Bone Marker")
"""Markers where the rigid body or skeleton would have them, exported beside or instead of the measured ones."""
_RATES = ("Export Frame Rate", "Capture Frame Rate")
_LONGEST_HEADER = 12
"""Lines up to the row `Frame,Time (Seconds),X,Y,Z`, at most."""


def matches(head: bytes) -> bool:
    """Return whether the file begins with the version of the format."""
    return head.startswith(b"Format Version,")


def read(path: Path) -> StoredCapture:
    """Read the measured markers of a file; those of the solver if there are no others.

    Raises:
        InputError: if it is damaged, or has no markers; the message states the line.
    """
    lines = text_lines(path)
    head = _header(lines, path)
    pairs = _cells(head[0])
    values = dict(zip(pairs[::2], pairs[1::2], strict=False))
    columns, names, kind = _columns(head, path)
    stated = next((values[name] for name in _RATES if is_number(values.get(name, ""))), None)
    rate = None if stated is None else positive_number(stated, f"{path}, line 1: the frame rate")
    rows = read_rows(lines, ",", columns, path)
    clock = timing(rows, path, rate)
    solved = ("the file has no measured markers; these are the solver's",) if kind in _SOLVED else ()
    notes, unit = (*solved, *clock.notes), values.get("Length Units")
    return StoredCapture(tuple(names), clock.spread(rows.points), clock.rate, unit, None, clock.first_frame, notes)


def _header(lines: Iterator[Line], path: Path) -> list[Line]:
    """Return the lines up to the row of axes."""
    head: list[Line] = []
    for line in islice(lines, _LONGEST_HEADER):
        head.append(line)
        if line[1].lstrip('"').startswith("Frame"):
            return head
    raise InputError(f"{path}: expected a row 'Frame,Time (Seconds),X,Y,Z' within {_LONGEST_HEADER} lines, found none")


def _columns(head: list[Line], path: Path) -> tuple[Columns, list[str], str]:
    """Return the columns of the markers' positions, their names, and the type of the first one."""
    *described, axes = [_cells(line) for line in head[1:]]
    quantities = next((cells for cells in described if "Position" in cells), [])
    for wanted in (_MEASURED, _SOLVED):
        # The names stand below the types.
        for kinds, names in pairwise(described):
            chosen = [
                first
                for first in range(2, min(len(axes) - 2, len(kinds), len(names), len(quantities)))
                if kinds[first] in wanted
                and quantities[first] == "Position"
                and axes[first : first + 3] == ["X", "Y", "Z"]
            ]
            if chosen:
                columns = Columns(len(axes), tuple(chosen), frame=0, time=1)
                return columns, [names[first] for first in chosen], kinds[chosen[0]]
    place = f"{path}, line {head[-1][0]}"
    raise InputError(f"{place}: expected columns X, Y, Z of markers, found none: export the markers")


def _cells(line: Line) -> list[str]:
    return [cell.strip().strip('"') for cell in line[1].split(",")]


FORMAT = CaptureFormat("Motive CSV", (".csv",), matches, read)
