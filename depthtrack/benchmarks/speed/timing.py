"""Time many short calls; on a shared machine, the best and the median call count."""

from collections.abc import Callable
from time import perf_counter

import numpy as np

from depthtrack.errors import InputError
from depthtrack.types import Array


def time_calls(call: Callable[[], object], seconds: float) -> Array:
    """Return the durations (N,) of successive calls within `seconds`, at least one, s."""
    durations, end = [], perf_counter() + seconds
    while True:
        start = perf_counter()
        call()
        stop = perf_counter()
        durations.append(stop - start)
        if stop >= end:
            return np.array(durations)


def checked_seconds(seconds: float) -> float:
    """Return the time for one row of a benchmark.

    Raises:
        InputError: if it is out of range.
    """
    if not 0 < seconds <= 600:
        raise InputError(f"--seconds must be above 0 and at most 600 per row, found {seconds:g}")
    return seconds
