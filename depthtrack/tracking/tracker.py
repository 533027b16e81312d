"""The tracker protocol: start on a frame, then one call per frame."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

from numpy.typing import ArrayLike

from depthtrack.hand.shape import HandShape
from depthtrack.recording.branches import Branch
from depthtrack.recording.run_rows import UNKNOWN_SPREAD, UNKNOWN_VISIBILITY
from depthtrack.recording.status import Status
from depthtrack.segmentation.observation import Observation
from depthtrack.types import Array


@dataclass(frozen=True)
class Estimate:
    """Estimate of a tracker for one frame.

    pose: (27,) pose vector, None if no hand was observed.
    energy: E of Oikonomidis et al. 2011, Eq. (1); NaN without a pose.
    agreement: agreement of rendered and observed silhouette, 0 to 1 (1 minus the silhouette term of Eq. 2).
    status: tracked, started, lost or absent.
    stage_ms: milliseconds spent in each stage of the tracker.
    confidence: probability that the largest joint error is below 20 mm; NaN if unknown.
    visibility: share of each finger that is visible, 0 to 1; NaN if unknown.
    spread: distance (21,) of the keypoints from the truth that about 68 % stay below, metres; NaN if unknown.
    branches: alternatives to the pose that the next frame goes on with.
    timestamp: time of the frame, seconds; NaN if unknown, which counts as no time since the frame before.
    hand: hand that was tracked, if its sizes change while it is tracked.
    seen_energy: energy of what nothing hides of the hand, whose part outside the image counts as completely wrong; NaN
        if unknown.
    """

    pose: Array | None
    energy: float
    agreement: float
    status: Status
    stage_ms: dict[str, float] = field(default_factory=dict)
    timestamp: float = math.nan
    confidence: float = math.nan
    visibility: tuple[float, ...] = UNKNOWN_VISIBILITY
    spread: tuple[float, ...] = UNKNOWN_SPREAD
    branches: tuple[Branch, ...] = ()
    hand: HandShape | None = None
    seen_energy: float = math.nan

    @property
    def comparable_energy(self) -> float:
        """Energy by which hands and places are compared.

        It is `seen_energy`, or `energy` if that is unknown.
        """
        return self.energy if math.isnan(self.seen_energy) else self.seen_energy


ABSENT = Estimate(None, math.nan, 0.0, Status.ABSENT)
"""Estimate of a frame without a hand."""


class Guide(Protocol):
    """Predicts where the hand is, from the estimates so far."""

    def restore(self, estimates: Sequence[Estimate]) -> None:
        """Update the state with estimates of frames that were tracked before, or had no hand.

        A new tracker that restores the estimates of all frames so far continues exactly as the one that made them.
        """
        ...

    def predicted_pose(self, timestamp: float) -> Array | None:
        """Return the pose (27,) predicted for `timestamp` (s); None for no ROI prior."""
        ...

    def doubted_pose(self, timestamp: float) -> Array | None:
        """Return the pose (27,) predicted for `timestamp` (s) by a track in doubt; else None."""
        ...


class Tracker(Guide, Protocol):
    """Follows one hand. Its state depends on its estimates alone, so that a run can be resumed."""

    name: str
    stages: tuple[str, ...]
    """Keys of `Estimate.stage_ms`."""

    def start(self, observation: Observation, pose: ArrayLike | None = None) -> Estimate:
        """Start on this frame: refine a given pose (27,), or search for one."""
        ...

    def track(self, observation: Observation) -> Estimate:
        """Follow the hand into the next frame; search if there is nothing to follow."""
        ...

    def close(self) -> None:
        """Free the renderers of the tracker."""
        ...
