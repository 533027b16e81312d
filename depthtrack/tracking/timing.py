"""The time of each stage of a tracker, and the time at which the searches of a frame end."""

import math
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Self

FOR_FIT = 0.25
"""Share of the deadline that is left to fit the best pose of a search."""


class StageClock:
    """Clock of consecutive stages: `milliseconds` of each, 0 for stages that did not run."""

    def __init__(self, stages: Iterable[str]) -> None:
        self.milliseconds = dict.fromkeys(stages, 0.0)
        self._last = time.perf_counter()

    def lap(self, stage: str) -> None:
        """Add the time since the last lap to a stage."""
        now = time.perf_counter()
        self.milliseconds[stage] += 1e3 * (now - self._last)
        self._last = now


@dataclass(frozen=True)
class Deadline:
    """The time at which the searches of a frame end, so that its pose is not late.

    ends: seconds of `clock`; infinity for none.
    length: time that a frame has, seconds; 0 for none.

    The poses of frames that end by it depend on the speed of the machine.
    """

    ends: float = math.inf
    length: float = 0.0
    clock: Callable[[], float] = time.perf_counter

    @classmethod
    def after(cls, milliseconds: float | None, arrived: float) -> Self:
        """Return the deadline of a frame that arrived at a time, seconds; now if NaN."""
        if milliseconds is None:
            return cls()
        length = 1e-3 * milliseconds
        return cls((cls.clock() if math.isnan(arrived) else arrived) + length, length)

    def sooner(self, share: float) -> "Deadline":
        """Return the deadline that leaves a share of the length for work after it."""
        return replace(self, ends=self.ends - share * self.length)

    @property
    def is_set(self) -> bool:
        """Whether there is a deadline."""
        return self.ends < math.inf

    @property
    def is_over(self) -> bool:
        """Whether the time has come."""
        return self.is_set and self.clock() >= self.ends
