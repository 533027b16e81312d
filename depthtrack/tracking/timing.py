"""The time of each stage of a tracker."""

import time
from collections.abc import Iterable


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
