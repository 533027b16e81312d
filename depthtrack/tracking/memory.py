"""What a tracker remembers from frame to frame: taken from its estimates alone, so that a run can be resumed."""

from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthtrack.hand.pose import retract, tangent_between
from depthtrack.tracking.tracker import Estimate, Status

Array = NDArray[np.float64]

_USUAL_FRAMES = 30


@dataclass(frozen=True)
class LostBelow:
    """When a pose no longer explains the hand.

    Below `confidence`, or where its energy exceeds both `energy` and twice what was usual over the last second: a hand
    of other sizes than the model's has a high energy all the time. From `sure` on, a pose may guide segmentation.
    """

    confidence: float = 0.6
    energy: float = 12.0
    sure: float = 0.6


class TrackMemory:
    """The last pose (27,), or None where there is nothing to follow; `velocity` (26,), its last step; its `energy`."""

    def __init__(self, limits: LostBelow) -> None:
        self._limits = limits
        self._confidence = 0.0
        self._usual: deque[float] = deque(maxlen=_USUAL_FRAMES)
        self.pose: Array | None = None
        self.velocity = np.zeros(26)
        self.energy = np.inf

    def is_lost(self, energy: float, confidence: float) -> bool:
        """Whether a pose with this energy and confidence is not to be trusted."""
        usual = float(np.median(self._usual)) if self._usual else np.inf
        return confidence < self._limits.confidence or energy > max(self._limits.energy, 2 * usual)

    def settle(
        self, pose: Array, energy: float, confidence: float, status: Status, stage_ms: dict[str, float]
    ) -> Estimate:
        """The estimate of the next frame, remembered: with this `status` unless the pose is not to be trusted."""
        trusted = not self.is_lost(energy, confidence)
        estimate = Estimate(pose, energy, confidence, status if trusted else Status.LOST, stage_ms)
        self.remember(estimate)
        return estimate

    def remember(self, estimate: Estimate) -> None:
        """Take in the estimate of the next frame."""
        if estimate.pose is None or estimate.status is Status.LOST:
            self.pose, self.velocity = None, np.zeros(26)
            return
        if self.pose is not None and estimate.status is Status.TRACKED:
            self.velocity = tangent_between(self.pose, estimate.pose)
        else:
            self.velocity = np.zeros(26)
        self.pose, self.energy, self._confidence = estimate.pose, estimate.energy, estimate.confidence
        self._usual.append(estimate.energy)

    @property
    def expected(self) -> Array | None:
        """The linear prediction (27,), while the track is sure."""
        if self.pose is None or self._confidence < self._limits.sure:
            return None
        return retract(self.pose, self.velocity)
