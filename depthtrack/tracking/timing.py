"""The time that each stage of a tracker takes."""

import time
from collections.abc import Iterable


class StageClock:
    """`milliseconds` of each of some stages, which end one after the other; 0 for those that did not take place."""

    def __init__(self, stages: Iterable[str]) -> None:
        self.milliseconds = dict.fromkeys(stages, 0.0)
        self._last = time.perf_counter()

    def lap(self, stage: str) -> None:
        """All time since the last lap was this stage's."""
        now = time.perf_counter()
        self.milliseconds[stage] += 1e3 * (now - self._last)
        self._last = now
