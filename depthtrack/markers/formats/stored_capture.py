"""A capture as its file states it, and the protocol of a file format."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from depthtrack.errors import InputError
from depthtrack.markers.capture import MarkerCapture
from depthtrack.types import Array

MAX_SAMPLES = 1 << 25
"""Largest number of frames times trajectories: an hour of 46 markers at 200 Hz."""
FARTHEST = 1e7
"""Largest coordinate, any unit."""
MAX_TRAJECTORIES = 65_535
"""Largest number of trajectories, the limit of C3D."""


@dataclass(frozen=True, eq=False)
class StoredCapture:
    """T frames of M trajectories in the terms of the file.

    labels: as written, blank, repeated or of another number than M.
    positions: (T, M, 3) unit of the file; NaN where the file has no number.
    rate: frames a second, Hz; None if the file states none.
    unit: as written; None if the file states none.
    residuals: (T, M) unit of the file, below 0 where nothing was measured; NaN if unknown; None if the file has none.
    first_frame: number of the first frame.
    notes: what was repaired while parsing, a sentence each.
    """

    labels: tuple[str, ...]
    positions: Array
    rate: float | None = None
    unit: str | None = None
    residuals: Array | None = None
    first_frame: int = 1
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class CaptureFormat:
    """A file format.

    description: with its article, for errors.
    suffixes: endings of its files in lower case; the first format with a suffix writes it.
    matches: whether a file that begins with these bytes has the format.
    read: returns what a file states; raises InputError with the line or byte if it is damaged.
    write: writes a capture; None if the format is only read.
    """

    description: str
    suffixes: tuple[str, ...]
    matches: Callable[[bytes], bool]
    read: Callable[[Path], StoredCapture]
    write: Callable[[Path, MarkerCapture], None] | None = None


def check_dimensions(frames: int, trajectories: int, where: str) -> None:
    """Raise InputError unless a capture of this size can be held in memory."""
    if not 1 <= trajectories <= MAX_TRAJECTORIES:
        raise InputError(f"{where}: expected 1 to {MAX_TRAJECTORIES:,} trajectories, found {trajectories:,}")
    if frames < 1:
        raise InputError(f"{where}: expected at least one frame, found none")
    if frames * trajectories > MAX_SAMPLES:
        size = f"{frames:,} frames of {trajectories:,} trajectories"
        raise InputError(f"{where}: expected at most {MAX_SAMPLES:,} samples, found {size}: split the capture")
