"""Units of stored times: seconds, their parts, or numbers of frames."""

from dataclasses import dataclass

import numpy as np

from depthtrack.errors import InputError
from depthtrack.recording.reading import TimeUnit
from depthtrack.types import Array

ASSUMED_RATE = 30.0
"""Rate of recordings that state no times, Hz."""
LATEST = 1e12
"""Bound on times in recordings and runs, seconds."""
SECONDS_PER_UNIT: dict[TimeUnit, float] = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "frames": 1 / ASSUMED_RATE}
UNIT_NAMES: dict[TimeUnit, str] = {
    "s": "seconds",
    "ms": "milliseconds",
    "us": "microseconds",
    "ns": "nanoseconds",
    "frames": f"numbers of frames at {ASSUMED_RATE:g} Hz",
    "index": f"ignored: frames are {ASSUMED_RATE:g} a second",
}

_LARGEST_STEPS: tuple[tuple[TimeUnit, float], ...] = (("s", 10.0), ("ms", 1e4), ("us", 1e7))
"""Units with the bound on their median step: periods from 10 ms to 10 s."""
_EPOCH = (9.4e8, 4.2e9)
"""Times since 1970 of the years 2000 to 2103, seconds."""
_PERIODS_SINCE_EPOCH = (1e-4, 60.0)
_USUAL_PERIODS = (1e-3, 2.0)
"""Periods of depth cameras, seconds; others are reported."""


@dataclass(frozen=True)
class Clock:
    """Conversion of stored times to seconds.

    unit: unit of the stored times.
    note: sentence for the user; None for ordinary seconds.
    """

    unit: TimeUnit
    note: str | None = None

    def seconds(self, stored: Array) -> Array:
        """Return seconds (N,) of stored times (N,).

        Raises:
            InputError: if a time is beyond `LATEST`.
        """
        if self.unit == "index":
            return np.arange(len(stored)) / ASSUMED_RATE
        # A division by 1000 rounds once, a product with 0.001 twice.
        times = stored / round(1 / SECONDS_PER_UNIT[self.unit])
        if len(times) and np.abs(times).max() >= LATEST:
            raise InputError(
                f"times must be below {LATEST:g} s, found {np.abs(times).max():g} s:"
                " give their unit with --time-unit ms, us or ns"
            )
        return times

    def times_between(self, stored: Array) -> Array:
        """Return seconds of times of other files; unchanged if times are ignored."""
        return stored if self.unit == "index" else self.seconds(stored)


def clock_of(stored: Array, whole: bool, unit: TimeUnit = "auto") -> Clock:
    """Return the conversion of stored times (N,), increasing.

    whole: whether the file writes all of them without a decimal point.
    unit: unit that the user states.
    """
    step = float(np.median(np.diff(stored))) if len(stored) > 1 else None
    chosen = _guess(stored, step, whole) if unit == "auto" else unit
    if unit == "auto" and chosen != "s":
        why = "because of their size" if step is None else f"because of their steps of {step:g}"
        return Clock(chosen, f"times are read as {UNIT_NAMES[chosen]} {why} (--time-unit states another unit)")
    if step is None or chosen == "index":
        return Clock(chosen)
    period = step * SECONDS_PER_UNIT[chosen]
    if _USUAL_PERIODS[0] <= period <= _USUAL_PERIODS[1]:
        return Clock(chosen)
    return Clock(
        chosen, f"frames are {period:g} s apart, unlike those of depth cameras (--time-unit states another unit)"
    )


def _guess(stored: Array, step: float | None, whole: bool) -> TimeUnit:
    """Return the unit that gives a time of our days, else the period of a camera."""
    since_1970 = abs(float(stored[0])) if len(stored) else 0.0
    for unit in ("s", "ms", "us", "ns"):
        scale = SECONDS_PER_UNIT[unit]
        plausible = step is None or _PERIODS_SINCE_EPOCH[0] <= step * scale <= _PERIODS_SINCE_EPOCH[1]
        if _EPOCH[0] <= since_1970 * scale <= _EPOCH[1] and plausible:
            return unit
    if step is None:
        return "s"
    if whole and step == 1:
        return "frames"
    return next((unit for unit, largest in _LARGEST_STEPS if step < largest), "ns")
