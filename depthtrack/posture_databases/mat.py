"""The database of the synergy papers: text named `.mat`, a posture a line of 26 numbers.

Three numbers for position and three for rotation precede the angles, radians. Each of thumb, index, middle, ring and
little finger has an abduction and three flexions from the palm outward.
Source: `fingerfist.mat` of OpenGP/htrack (Schroeder's Vicon recordings).

Signs and zeros are those of the recordings' mesh. Flexion is negative and abduction is positive away from the thumb.
Zero is the mesh's rest posture with spread fingers, htrack's `default.calib`. So our angle is that of the rest posture
minus the file's. Abduction there turns about an axis that flexion moves, here about one fixed in the palm. On
fingerfist.mat the difference turns a finger by 1 to 2 degrees on average, and by up to 12 in the fist (95th percentile,
index).
"""

from array import array
from pathlib import Path

import numpy as np

from depthtrack.errors import InputError
from depthtrack.files import open_regular, read_lines
from depthtrack.number_text import parse_numbers
from depthtrack.posture_databases.posture_set import MAX_BYTES, PostureSet, check_angles, check_count

COLUMNS, GLOBAL_COLUMNS = 26, 6
_BINARY = (b"MATLAB", b"\x89HDF")

REST = np.radians(
    np.array(
        [
            (-7, -17, 12, 0),
            (10, 5, -4, 0),
            (-1, 10, -7, 0),
            (-13, 2, 1, 0),
            (-27, -2, -1, 3),
        ],
        dtype=np.float64,
    ).ravel()
)
"""(20,) our angles, radians, of the file's zero posture."""


def matches(path: Path) -> bool:
    """Return whether the file name ends in .mat."""
    return path.suffix.lower() == ".mat" and path.is_file()


def read(path: Path) -> PostureSet:
    """Return all postures of the file.

    Raises:
        InputError: if a line does not have 26 finite numbers.
    """
    with open_regular(path) as file:
        start = file.read(6)
    if start.startswith(_BINARY):
        raise InputError(
            f"{path} must be text, 26 numbers a line, found MATLAB's binary format: save the matrix again with"
            "  save('FILE.mat', 'X', '-ascii')"
        )
    values, count = array("d"), 0
    for number, line in enumerate(read_lines(path, MAX_BYTES), start=1):
        fields = line.split()
        if not fields:
            continue
        values.extend(_row(fields, f"{path}, line {number}"))
        count += 1
        check_count(path, count)
    rows = np.array(values).reshape(-1, COLUMNS)
    return PostureSet(REST - check_angles(path, rows[:, GLOBAL_COLUMNS:]))


def _row(fields: list[str], where: str) -> list[float]:
    try:
        row = parse_numbers(fields)
    except ValueError:
        row = []
    if len(row) != COLUMNS or not np.isfinite(row).all():
        raise InputError(
            f"{where}: expected {COLUMNS} finite numbers, found {len(fields)} fields beginning {fields[0][:20]!r}"
        )
    return row
