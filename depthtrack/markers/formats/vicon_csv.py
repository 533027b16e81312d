"""CSV of Vicon Nexus, which has sections; Trajectories is read.

Source: Vicon Nexus documentation, "ASCII file format".
"""

from collections.abc import Iterator
from itertools import islice
from pathlib import Path

from depthtrack.errors import InputError
from depthtrack.markers.formats.stored_capture import CaptureFormat, StoredCapture
from depthtrack.markers.formats.text_rows import Columns, Line, positive_number, read_rows, text_lines
from depthtrack.markers.formats.timing import timing

_SECTION = "Trajectories"
_SECTIONS = (_SECTION, "Devices", "Joints", "Model Outputs", "Segments", "Events", "Bones")


def matches(head: bytes) -> bool:
    """Return whether the first line that is not blank is the name of a section."""
    first = head.lstrip(b'\r\n", ').partition(b"\n")[0]
    return first.strip(b'\r", ').decode("latin-1") in _SECTIONS


def read(path: Path) -> StoredCapture:
    """Read the section Trajectories of a file.

    Raises:
        InputError: if the section is missing or damaged; the message states the line.
    """
    lines = text_lines(path)
    if not any(_cells(line)[0] == _SECTION for line in lines):
        raise InputError(f"{path}: expected a section '{_SECTION}', found none: export the trajectories")
    header = list(islice(lines, 4))
    if len(header) < 4:
        raise InputError(f"{path}: expected a rate, names, columns, units and rows below '{_SECTION}', found the end")
    rate_line, names, axes, units = header
    rate = positive_number(_cells(rate_line)[0], f"{path}, line {rate_line[0]}: the rate")
    columns = _columns(axes, path)
    named = _cells(names)
    labels = tuple(named[first] if first < len(named) else "" for first in columns.coordinates)
    rows = read_rows(_section(lines), ",", columns, path)
    clock = timing(rows, path, rate)
    unit = next((cell for cell in _cells(units) if cell), None)
    return StoredCapture(labels, clock.spread(rows.points), clock.rate, unit, None, clock.first_frame, clock.notes)


def _cells(line: Line) -> list[str]:
    return [cell.strip().strip('"') for cell in line[1].split(",")]


def _columns(axes: Line, path: Path) -> Columns:
    cells = _cells(axes)
    coordinates = tuple(first for first in range(len(cells) - 2) if cells[first : first + 3] == ["X", "Y", "Z"])
    if not coordinates or cells[0] != "Frame":
        found = ", ".join(cells[:5])[:60]
        raise InputError(f"{path}, line {axes[0]}: expected Frame, Sub Frame, X, Y, Z and so on, found {found!r}")
    return Columns(len(cells), coordinates, frame=0)


def _section(lines: Iterator[Line]) -> Iterator[Line]:
    """Yield the lines up to a blank one, which ends a section."""
    for line in lines:
        if not line[1].strip(", "):
            return
        yield line


FORMAT = CaptureFormat("Vicon CSV", (".csv",), matches, read)
