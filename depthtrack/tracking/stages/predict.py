"""Prediction of the next pose from the last motion."""

from dataclasses import dataclass

import numpy as np

from depthtrack.hand.limits import within_limits
from depthtrack.hand.pose import retract
from depthtrack.tracking.candidate import Candidate
from depthtrack.tracking.frame import FrameContext


@dataclass(frozen=True)
class Predict:
    """Propose the last pose moved on by each share of the last motion, best first."""

    shares: tuple[float, ...]
    name: str = "predict"

    def __call__(self, frame: FrameContext, candidates: list[Candidate]) -> list[Candidate]:
        last = frame.state.pose
        assert last is not None
        shares = self.shares if frame.motion.any() else self.shares[:1]
        ahead = within_limits(retract(last, np.outer(shares, frame.motion)))
        frame.predictions = frame.evaluate(ahead)
        return frame.predictions


@dataclass(frozen=True)
class GivenPose:
    """Propose the pose that the user gave; it is not scored yet."""

    name: str = "predict"

    def __call__(self, frame: FrameContext, candidates: list[Candidate]) -> list[Candidate]:
        assert frame.start_pose is not None
        return [Candidate(within_limits(frame.start_pose), np.inf, 0.0)]
