"""A tracker timed by the processor instead of the clock on the wall: runs that share a machine compare fairly."""

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

from numpy.typing import ArrayLike

from depthtrack.segmentation.observation import Observation
from depthtrack.tracking.tracker import Estimate, Tracker
from depthtrack.types import Array


class CpuTimed:
    """A tracker as it is, but its stages' times are CPU milliseconds of this process, all of its threads together.

    How a frame's time falls to the stages is as the tracker says; their sum is the processor's.
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

    @property
    def predicted_pose(self) -> Array | None:
        return self._tracker.predicted_pose

    def close(self) -> None:
        self._tracker.close()


def _timed(call: Callable[[], Estimate]) -> Estimate:
    begun = time.process_time()
    estimate = call()
    spent = 1e3 * (time.process_time() - begun)
    told = sum(estimate.stage_ms.values())
    if told <= 0:
        return estimate
    return replace(estimate, stage_ms={stage: ms * spent / told for stage, ms in estimate.stage_ms.items()})
