"""The frames that rows of a text file belong to, and their rate."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from depthtrack.errors import InputError
from depthtrack.markers.formats.stored_capture import check_dimensions
from depthtrack.markers.formats.text_rows import Rows
from depthtrack.types import Array, Index

_SAME_RATE = 0.01
"""Largest relative difference between the durations by a header's rate and by times that agree."""


@dataclass(frozen=True, eq=False)
class Timing:
    """The frames of rows.

    places: (T,) of the rows among the frames, from 0; a place without a row is a gap.
    rate: Hz; None if unknown.
    first_frame: number of the first frame.
    notes: on missing rows and on the rate.
    """

    places: Index
    rate: float | None
    first_frame: int
    notes: tuple[str, ...]

    def spread(self, points: Array) -> Array:
        """Return points (T, M, 3) with rows of NaN where frames are missing."""
        count = int(self.places[-1]) + 1
        if count == len(points):
            return points
        complete = np.full((count, *points.shape[1:]), np.nan)
        complete[self.places] = points
        return complete


def timing(rows: Rows, path: Path, stated_rate: float | None = None) -> Timing:
    """Return the timing of rows. Their times count where the header states another rate.

    stated_rate: Hz, of the header.

    Raises:
        InputError: if frames or times do not increase, or would leave more gaps than a capture may have frames.
    """
    numbers = np.arange(1.0, len(rows.points) + 1)
    if rows.times is not None:
        _check_increase(rows.times, rows, path, "times")
        steps = np.diff(rows.times)
        if rows.frames is None and len(steps):
            numbers = 1 + np.concatenate([[0.0], np.cumsum(np.round(steps / np.median(steps)))])
            _check_increase(numbers, rows, path, "times at a constant rate")
    if rows.frames is not None:
        numbers = rows.frames
        _check_increase(numbers, rows, path, "frames")
        parts = numbers != np.floor(numbers)
        if parts.any():
            raise InputError(f"{path}, line {rows.lines[parts.argmax()]}: expected the whole number of a frame")
    rate, notes = _rate(rows.times, numbers, stated_rate)
    places = (numbers - numbers[0]).astype(np.int64)
    count = int(places[-1]) + 1
    check_dimensions(count, rows.points.shape[1], str(path))
    if count > len(places):
        notes += (f"{count - len(places)} frames have no row in the file and are gaps",)
    return Timing(places, rate, int(numbers[0]), notes)


def _rate(times: Array | None, numbers: Array, stated: float | None) -> tuple[float | None, tuple[str, ...]]:
    """Return the rate of the times, whose digits are few, over the whole file."""
    if times is None or len(times) < 2:
        return stated, ()
    count, span = numbers[-1] - numbers[0], times[-1] - times[0]
    found = float(f"{count / span:.9g}")
    if stated is None:
        return found, ()
    if abs(count / stated - span) <= max(_SAME_RATE * span, span / count / 2):
        return stated, ()
    return found, (f"the header states {stated:g} Hz, the times {found:g} Hz; the times count",)


def _check_increase(values: Array, rows: Rows, path: Path, what: str) -> None:
    falls = np.flatnonzero(np.diff(values) <= 0)
    if len(falls):
        row = falls[0] + 1
        place, found = f"{path}, line {rows.lines[row]}", f"{values[row]:.10g} after {values[row - 1]:.10g}"
        raise InputError(f"{place}: {what} must increase, found {found}")
