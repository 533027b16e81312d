"""What a tracker remembers from frame to frame: taken from its estimates alone, so that a run can be resumed."""

from collections import deque
from dataclasses import dataclass

import numpy as np

from depthtrack.hand.pose import retract, tangent_between
from depthtrack.recording.status import Status
from depthtrack.tracking.tracker import Estimate
from depthtrack.types import Array

_MEDIAN_FRAMES, _RECENT_FRAMES = 30, 15
"""Frames over which the energy's median is what is usual, and for which a lost hand's last pose is remembered."""
_GUIDE_RATIO, _LOST_RATIO = 1.3, 2.0
"""Times the usual energy from which a pose is not to guide, and not to be trusted."""


@dataclass(frozen=True)
class TrackingThresholds:
    """When a pose no longer explains the hand.

    Below `confidence`, or where its energy exceeds both `energy` and twice what was usual over the last second: a hand
    of other sizes than the model's has a high energy all the time. A hand seen edge on by a noisy sensor reaches 15 in
    its true pose; a fist of a hand that is not quite the model's agrees by little more than half.

    A pose may guide segmentation from the confidence `guide_confidence` on, unless its energy exceeds both `energy`
    and 1.3 times the usual: else a wrong pose would cut out what agrees with it.
    """

    confidence: float = 0.5
    energy: float = 16.0
    guide_confidence: float = 0.6


class TrackState:
    """The last pose (27,), or None where there is nothing to follow; `velocity` (26,), its last step; its `energy`.

    `last_trusted` (27,) is the last pose that was trusted, None after _RECENT_FRAMES without one: half a second at 30
    Hz, in which a hand has hardly turned over.
    """

    def __init__(self, limits: TrackingThresholds) -> None:
        self._limits = limits
        self._confidence = 0.0
        self._usual: deque[float] = deque(maxlen=_MEDIAN_FRAMES)
        self.pose: Array | None = None
        self.velocity = np.zeros(26)
        self.energy = np.inf
        self.last_trusted: Array | None = None
        self._frames_lost = 0

    def is_lost(self, energy: float, confidence: float, limits: TrackingThresholds | None = None) -> bool:
        """Whether a pose with this energy and confidence is not to be trusted, by these or the usual limits."""
        limits = limits or self._limits
        usual = float(np.median(self._usual)) if self._usual else np.inf
        return confidence < limits.confidence or energy > max(limits.energy, _LOST_RATIO * usual)

    def commit(
        self, pose: Array, energy: float, confidence: float, status: Status, stage_ms: dict[str, float]
    ) -> Estimate:
        """The estimate of the next frame, remembered: with this `status` unless the pose is not to be trusted."""
        trusted = not self.is_lost(energy, confidence)
        estimate = Estimate(pose, energy, confidence, status if trusted else Status.LOST, stage_ms)
        self.update(estimate)
        return estimate

    def update(self, estimate: Estimate) -> None:
        """Take in the estimate of the next frame."""
        if estimate.pose is None or estimate.status is Status.LOST:
            self.pose, self.velocity = None, np.zeros(26)
            self._frames_lost += 1
            if self._frames_lost > _RECENT_FRAMES:
                self.last_trusted = None
            return
        if self.pose is not None and estimate.status is Status.TRACKED:
            self.velocity = tangent_between(self.pose, estimate.pose)
        else:
            self.velocity = np.zeros(26)
        self.pose, self.energy, self._confidence = estimate.pose, estimate.energy, estimate.confidence
        self.last_trusted, self._frames_lost = estimate.pose, 0
        self._usual.append(estimate.energy)

    @property
    def predicted_pose(self) -> Array | None:
        """The linear prediction (27,), while the track is sure."""
        if self.pose is None or self._confidence < self._limits.guide_confidence:
            return None
        if self.energy > max(self._limits.energy, _GUIDE_RATIO * float(np.median(self._usual))):
            return None
        return retract(self.pose, self.velocity)
