"""The tables of a marker folder: a row a frame, a column a marker, blanks if unknown."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from depthtrack.errors import InputError
from depthtrack.hand.pose import POSE_NAMES, POSE_SIZE
from depthtrack.number_text import parse_numbers_or_blanks
from depthtrack.recording.run_tables import read_table, rewrite_table
from depthtrack.types import Array

RIGID_COLUMNS = ("frame", "time", *POSE_NAMES[:7])


def write_values(path: Path, labels: Sequence[str], first_frame: int, values: Array) -> None:
    """Write values (T, M), NaN as blanks; the numbers read back bitwise equal.

    Raises:
        InputError: if a label cannot be in a table, or the file cannot be written.
    """
    check_labels(labels)
    rows = ([str(first_frame + t), *map(_cell, row)] for t, row in enumerate(values.tolist()))
    rewrite_table(path, ("frame", *labels), rows)


def read_values(path: Path, labels: Sequence[str], frames: int) -> Array:
    """Return the values (T, M) of a table.

    Raises:
        InputError: if the table is malformed, or of other labels or frames.
    """
    rows = read_table(path, ("frame", *labels))
    if len(rows) != frames:
        raise InputError(f"{path}: expected {frames} rows of frames, found {len(rows)}")
    return _numbers(path, rows, slice(1, None)).reshape(frames, len(labels))


def write_rigid_poses(path: Path, first_frame: int, times: Array, poses: Array) -> None:
    """Write position and quaternion of each pose (T, 27), blank without one.

    Raises:
        InputError: if the file cannot be written.
    """
    numbers = poses[:, :7].tolist()
    rows = (
        [str(first_frame + t), repr(float(time)), *map(_cell, pose)]
        for t, (time, pose) in enumerate(zip(times, numbers, strict=True))
    )
    rewrite_table(path, RIGID_COLUMNS, rows)


def read_rigid_poses(path: Path, frames: int) -> Array:
    """Return the poses (T, 27) of a rigid body; NaN without one.

    Raises:
        InputError: if the table is malformed, or of other frames.
    """
    rows = read_table(path, RIGID_COLUMNS)
    if len(rows) != frames:
        raise InputError(f"{path}: expected {frames} rows of frames, found {len(rows)}")
    poses = np.zeros((frames, POSE_SIZE))
    poses[:, :7] = _numbers(path, rows, slice(2, None)).reshape(frames, 7)
    poses[~np.isfinite(poses).all(axis=1)] = np.nan
    return poses


def check_labels(labels: Sequence[str]) -> None:
    """Raise InputError if a label cannot be the name of a column."""
    for label in labels:
        if not label.isprintable() or set(label) & {",", '"'}:
            raise InputError(f"a label must have no comma, quote or control character, found {label[:40]!r}")


def _cell(value: float) -> str:
    return repr(value) if np.isfinite(value) else ""


def _numbers(path: Path, rows: list[list[str]], part: slice) -> Array:
    try:
        found = np.array([parse_numbers_or_blanks(row[part]) for row in rows], dtype=np.float64)
    except ValueError as error:
        raise InputError(f"{path}: expected numbers or blanks: {error!s:.120}") from error
    if np.isinf(found).any():
        raise InputError(f"{path}: expected finite numbers or blanks, found an infinite one")
    return found
