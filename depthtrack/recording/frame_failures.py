"""Unexpected failures inside one frame, which end no run: `failures.csv` of a run folder.

The file has a row for each failed frame, and exists only if there is one. The frame is absent in the other tables. If
it failed in the backward pass alone, they have its forward pose.
"""

from pathlib import Path
from traceback import extract_tb

from depthtrack.errors import DepthtrackError, InputError, printable
from depthtrack.files import write_atomic
from depthtrack.number_text import parse_whole_number
from depthtrack.recording.run_tables import read_table

FAILURES_FILE = "failures.csv"
_COLUMNS = ("index", "failure")
_LONGEST = 300
_OUTSIDE = (DepthtrackError, OSError, ImportError, MemoryError)
"""Errors whose cause is no content of a frame: a file, the user, a library, or the machine."""


def failure_text(error: Exception) -> str | None:
    """Return one line on an unexpected error, with its place; None if no frame is its cause."""
    if isinstance(error, _OUTSIDE):
        return None
    frames = extract_tb(error.__traceback__)
    place = f"{Path(frames[-1].filename).name}:{frames[-1].lineno}" if frames else "?"
    text = printable(f"{type(error).__name__} in {place}: {error}")[:_LONGEST]
    return text.replace(",", ";").replace('"', "'")


def append_failure(folder: Path, index: int, failure: str) -> None:
    """Add a frame to the failures of a run.

    Raises:
        InputError: if the file is malformed, or cannot be written.
    """
    _write(folder, {**read_failures(folder), index: failure})


def keep_failures(folder: Path, indices: frozenset[int]) -> None:
    """Drop the failures of other frames, which a run that was killed did not complete."""
    before = read_failures(folder)
    if not set(before) <= indices:
        _write(folder, {index: failure for index, failure in before.items() if index in indices})


def read_failures(folder: Path) -> dict[int, str]:
    """Return the failure of each frame that has one.

    Raises:
        InputError: if the file is malformed.
    """
    path = folder / FAILURES_FILE
    if not path.exists():
        return {}
    try:
        return {parse_whole_number(index): printable(failure) for index, failure in read_table(path, _COLUMNS)}
    except ValueError as error:
        raise InputError(f"{path}: expected the numbers of frames: {error}") from error


def _write(folder: Path, failures: dict[int, str]) -> None:
    lines = [",".join(_COLUMNS), *(f"{index},{failure}" for index, failure in failures.items())]
    write_atomic(folder / FAILURES_FILE, "\n".join(lines) + "\n")
