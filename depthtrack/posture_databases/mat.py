"""The synergy papers' own database: text named `.mat`, a posture a line of 26 numbers.

Three for position, three for rotation, then for thumb, index, middle, ring and little finger abduction and three
flexions from the palm outward, in radians. Found in OpenGP/htrack as `fingerfist.mat` (Schroeder's Vicon recordings).

Its signs and zeros are those of the mesh the recordings were made for: flexion is negative, abduction positive away
from the thumb, and zero is that mesh's rest posture, whose fingers are spread (htrack's `default.calib`, measured in
our angles). So an angle of ours is the rest posture's less the file's. There, abduction turns about an axis that
flexion has moved, here about one fixed in the palm: on fingerfist.mat that turns a finger by 1 to 2 degrees on
average, and up to 12 in the fist (95th percentile, index).
"""

from array import array
from pathlib import Path

import numpy as np

from depthtrack.errors import InputError
from depthtrack.files import read_lines
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
"""(20,) our angles of the posture that the file calls zero."""


def matches(path: Path) -> bool:
    """Whether the file is named like one of these."""
    return path.suffix.lower() == ".mat" and path.is_file()


def read(path: Path) -> PostureSet:
    """All postures of the file. Raises InputError for anything but lines of 26 numbers."""
    with path.open("rb") as file:
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
        row = [float(field) for field in fields]
    except ValueError:
        row = []
    if len(row) != COLUMNS or not np.isfinite(row).all():
        raise InputError(
            f"{where}: expected {COLUMNS} finite numbers, found {len(fields)} fields beginning {fields[0][:20]!r}"
        )
    return row
