"""Plain CSV: one header row of `name-X,name-Y,name-Z`, perhaps after `frame` and `time` (s)."""

import re
from pathlib import Path

from depthtrack.errors import InputError
from depthtrack.files import replace_atomically
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.formats.stored_capture import CaptureFormat, StoredCapture
from depthtrack.markers.formats.text_rows import Columns, decoded, read_rows, text_lines
from depthtrack.markers.formats.timing import timing

_COORDINATE = re.compile(r"(.*?)[-_. :]?([XYZ])", re.IGNORECASE | re.DOTALL)
_KEYS = ("frame", "time")


def matches(head: bytes) -> bool:
    """Return whether the first row names coordinates."""
    cells = _header_cells(decoded(head.removeprefix(b"\xef\xbb\xbf").partition(b"\n")[0]))
    first = len(_keys(cells))
    return len(cells) >= first + 3 and _label(cells[first : first + 3]) is not None


def read(path: Path) -> StoredCapture:
    """Read a file.

    Raises:
        InputError: if it is damaged; the message states the line.
    """
    lines = text_lines(path)
    _, header = next(lines, (1, ""))
    cells = _header_cells(header)
    while cells and not cells[-1]:
        cells.pop()
    keys = _keys(cells)
    labels = tuple(_labels(cells, len(keys), path))
    rows = read_rows(lines, ",", Columns.plain(tuple(keys), len(labels)), path)
    clock = timing(rows, path)
    return StoredCapture(
        labels, clock.spread(rows.points), clock.rate, first_frame=clock.first_frame, notes=clock.notes
    )


def write(path: Path, capture: MarkerCapture) -> None:
    """Write a capture in millimetres after `frame` and `time` (s); NaN in gaps.

    Raises:
        InputError: if a label holds a comma or a quote, or the file cannot be written.
    """
    for label in capture.labels:
        if not label.isprintable() or set(label) & {",", '"'}:
            raise InputError(f"a label in CSV must have no comma, quote or control character, found {label[:40]!r}")
    names = [f"{label}-{axis}" for label in capture.labels for axis in "XYZ"]
    with replace_atomically(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        file.write(",".join(["frame", "time", *names]) + "\n")
        table = (capture.positions * 1000).reshape(len(capture), -1)
        for row, (time, values) in enumerate(zip(capture.times, table, strict=True)):
            cells = [str(capture.first_frame + row), repr(float(time)), *map(repr, values.tolist())]
            file.write(",".join(cells) + "\n")


def _header_cells(line: str) -> list[str]:
    return [cell.strip().strip('"') for cell in line.split(",")]


def _keys(cells: list[str]) -> list[str]:
    """Return the leading columns that are no coordinates, by their standard names."""
    keys: list[str] = []
    for cell in cells[:2]:
        name = cell.lower().partition("(")[0].strip(" #_")
        name = {"timestamp": "time", "t": "time", "seconds": "time"}.get(name, name)
        if name not in _KEYS or name in keys:
            break
        keys.append(name)
    return keys


def _labels(cells: list[str], first: int, path: Path) -> list[str]:
    where = f"{path}, line 1"
    coordinates = cells[first:]
    if len(coordinates) % 3 or not coordinates:
        raise InputError(f"{where}: expected three columns name-X, name-Y, name-Z a marker, found {len(cells)} columns")
    labels = []
    for column in range(0, len(coordinates), 3):
        label = _label(coordinates[column : column + 3])
        if label is None:
            found = ", ".join(coordinates[column : column + 3])[:80]
            place = f"{where}, cell {first + column + 1}"
            raise InputError(f"{place}: expected name-X, name-Y, name-Z, found {found!r}")
        labels.append(label)
    return labels


def _label(cells: list[str]) -> str | None:
    """Return the name that three cells share, None if they are no coordinates of one marker."""
    found = [_COORDINATE.fullmatch(cell) for cell in cells]
    names = {match[1] for match in found if match}
    axes = "".join(match[2] for match in found if match).upper()
    return names.pop() if axes == "XYZ" and len(names) == 1 else None


FORMAT = CaptureFormat("plain CSV (name-X,name-Y,name-Z)", (".csv",), matches, read, write)
