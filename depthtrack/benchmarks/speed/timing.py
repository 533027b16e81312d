"""Timing on machines that others use too: many short calls, of which the best and the median count."""

from collections.abc import Callable
from time import perf_counter

import numpy as np

from depthtrack.types import Array


def time_calls(call: Callable[[], object], seconds: float) -> Array:
    """Durations (N,) in seconds of calls made one after another until `seconds` have passed; at least one."""
    durations, end = [], perf_counter() + seconds
    while True:
        start = perf_counter()
        call()
        stop = perf_counter()
        durations.append(stop - start)
        if stop >= end:
            return np.array(durations)
