"""TRC, the tab-separated tracks of OpenSim.

Source: OpenSim documentation, "Marker (.trc) Files".
"""

import re
from itertools import chain, islice
from pathlib import Path

import numpy as np

from depthtrack.errors import InputError
from depthtrack.files import replace_atomically
from depthtrack.markers.capture import MarkerCapture
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

_KEYS = ("DataRate", "CameraRate", "NumFrames", "NumMarkers", "Units")
_AXIS = re.compile(r"[XYZ]\d*", re.IGNORECASE)


def matches(head: bytes) -> bool:
    """Return whether the file begins as a TRC file does."""
    return head.startswith(b"PathFileType")


def read(path: Path) -> StoredCapture:
    """Read a file. Counts and rates of its header give way to its columns, rows and times.

    Raises:
        InputError: if it is damaged; the message states the line.
    """
    lines = text_lines(path)
    head = list(islice(lines, 5))
    if len(head) < 5:
        raise InputError(f"{path}: expected five lines of header and rows of numbers, found {len(head)} lines")
    values = dict(zip(_cells(head[1]), _cells(head[2]), strict=False))
    labels, count = _labels(head[3], head[4], values.get("NumMarkers", ""), path)
    # Some programs leave out the row X1 Y1 Z1.
    first = [] if any(map(_AXIS.fullmatch, _cells(head[4]))) else [head[4]]
    rows = read_rows(chain(first, lines), "\t", Columns.plain(("frame", "time"), count), path)
    stated = values.get("DataRate", "")
    rate = positive_number(stated, f"{path}, line 3: DataRate") if is_number(stated) else None
    clock = timing(rows, path, rate)
    notes = (
        *count_note("markers", values.get("NumMarkers", ""), count),
        *count_note("frames", values.get("NumFrames", ""), len(rows.points)),
        *clock.notes,
    )
    unit = values.get("Units")
    return StoredCapture(labels, clock.spread(rows.points), clock.rate, unit, None, clock.first_frame, notes)


def write(path: Path, capture: MarkerCapture) -> None:
    """Write a capture in millimetres; NaN in gaps, which OpenSim reads as such.

    Raises:
        InputError: if a label has a tab or a line break, or the file cannot be written.
    """
    for label in capture.labels:
        if not label.isprintable() or not label.strip():
            raise InputError(f"a label in TRC must be printable and not blank, found {label[:40]!r}")
    rate, frames, count = f"{capture.rate:.10g}", len(capture), len(capture.labels)
    names = [cell for label in capture.labels for cell in (label, "", "")]
    axes = [f"{axis}{number}" for number in range(1, count + 1) for axis in "XYZ"]
    header = [
        ["PathFileType", "4", "(X/Y/Z)", path.name],
        [*_KEYS, "OrigDataRate", "OrigDataStartFrame", "OrigNumFrames"],
        [rate, rate, str(frames), str(count), "mm", rate, str(capture.first_frame), str(frames)],
        ["Frame#", "Time", *names],
        ["", "", *axes],
        [],
    ]
    table = (capture.positions * 1000).reshape(frames, -1)
    table = np.where(np.isfinite(table), table, np.nan)
    with replace_atomically(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        file.writelines("\t".join(cells) + "\n" for cells in header)
        for row, (time, values) in enumerate(zip(capture.times, table, strict=True)):
            numbers = ["NaN" if value != value else repr(value) for value in values.tolist()]
            file.write("\t".join([str(capture.first_frame + row), repr(float(time)), *numbers]) + "\n")


def _cells(line: Line) -> list[str]:
    return [cell.strip() for cell in line[1].split("\t")]


def _labels(names: Line, axes: Line, stated: str, path: Path) -> tuple[tuple[str, ...], int]:
    """Return the labels, and the number of markers by the row of axes, else by the header."""
    cells = _cells(names)
    if not cells[0].lower().startswith("frame"):
        raise InputError(f"{path}, line 4: expected Frame#, Time and the names of the markers, found {cells[0][:40]!r}")
    coordinates = [cell for cell in _cells(axes) if _AXIS.fullmatch(cell)]
    labels = cells[2:]
    # A name stands above each x, with two blank cells after it; some programs leave those out.
    apart = not any(labels[1::3]) and not any(labels[2::3])
    labels = labels[::3] if apart else [label for label in labels if label]
    while labels and not labels[-1]:
        labels.pop()
    if coordinates:
        return tuple(labels), len(coordinates) // 3
    return tuple(labels), whole_number(stated, f"{path}, line 3: NumMarkers") if stated else len(labels)


FORMAT = CaptureFormat("TRC", (".trc",), matches, read, write)
