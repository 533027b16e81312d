"""Files of a data set that are numbered instead of timed."""

import os
import re
from pathlib import Path

import numpy as np

from depthtrack.errors import DamagedFrameError, InputError
from depthtrack.recording.images import read_size
from depthtrack.recording.sequences.tum_lists import MAX_FRAMES
from depthtrack.types import Array

NOMINAL_RATE = 30.0
"""Frames a second, Hz, of data sets that store no times: frame n is at n / 30 s."""


def numbered_files(folder: Path, pattern: re.Pattern[str]) -> dict[int, str]:
    """Return the names of files in `folder` by their number, increasing.

    pattern: matches whole names; its only group is the number.

    Raises:
        InputError: if no file matches, too many do, or the folder cannot be read.
    """
    found: dict[int, str] = {}
    try:
        with os.scandir(folder) as entries:
            for entry in entries:
                if match := pattern.fullmatch(entry.name):
                    found[int(match[1])] = entry.name
    except OSError as error:
        raise InputError(f"cannot read {folder}: {error.strerror}") from error
    if not 1 <= len(found) <= MAX_FRAMES:
        raise InputError(f"{folder} must hold 1 to {MAX_FRAMES:,} files like {pattern.pattern}, found {len(found)}")
    return dict(sorted(found.items()))


def first_size(folder: Path, pattern: re.Pattern[str]) -> tuple[int, int]:
    """Return (width, height) of the first readable image whose name matches.

    Raises:
        InputError: if none can be read.
    """
    for name in numbered_files(folder, pattern).values():
        try:
            return read_size(folder / name)
        except DamagedFrameError:
            continue
    raise InputError(f"{folder}: none of the depth images can be read")


def has_file(folder: Path, pattern: re.Pattern[str]) -> bool:
    """Return whether `folder` is a readable folder with a file whose whole name matches."""
    try:
        with os.scandir(folder) as entries:
            return any(pattern.fullmatch(entry.name) for entry in entries)
    except OSError:
        return False


def nominal_times(numbers: list[int]) -> Array:
    """Return the times (N,), seconds, of numbered frames."""
    return np.array(numbers, dtype=np.float64) / NOMINAL_RATE
