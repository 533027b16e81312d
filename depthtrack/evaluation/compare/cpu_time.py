"""Time a tracker by CPU time, so that runs that share a machine compare fairly."""

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

from numpy.typing import ArrayLike

from depthtrack.segmentation.observation import Observation
from depthtrack.tracking.tracker import Estimate, Tracker
from depthtrack.types import Array


class CpuTimed:
    """Tracker whose stage times are CPU milliseconds of all threads of this process.

    The sum over the stages is the CPU time; the shares of the stages are those of the wrapped tracker.
    """

    def __init__(self, tracker: Tracker) -> None:
        self._tracker = tracker
        self.name, self.stages = tracker.name, tracker.stages

    def start(self, observation: Observation, pose: ArrayLike | None = None) -> Estimate:
        return _timed(lambda: self._tracker.start(observation, pose))

    def track(self, observation: Observation) -> Estimate:
        return _timed(lambda: self._tracker.track(observation))

    def restore(self, estimates: Sequence[Estimate]) -> None:
        self._tracker.restore(estimates)

    def predicted_pose(self, timestamp: float) -> Array | None:
        return self._tracker.predicted_pose(timestamp)

    def doubted_pose(self, timestamp: float) -> Array | None:
        return self._tracker.doubted_pose(timestamp)

    def close(self) -> None:
        self._tracker.close()


def _timed(call: Callable[[], Estimate]) -> Estimate:
    begun = time.process_time()
    estimate = call()
    spent = 1e3 * (time.process_time() - begun)
    reported = sum(estimate.stage_ms.values())
    if reported <= 0:
        return estimate
    return replace(estimate, stage_ms={stage: ms * spent / reported for stage, ms in estimate.stage_ms.items()})
