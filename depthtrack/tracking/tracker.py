"""The tracker protocol: start on a frame, then one call a frame. PSO and IK differ behind it, nowhere else."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

from numpy.typing import ArrayLike

from depthtrack.recording.status import Status
from depthtrack.segmentation.observation import Observation
from depthtrack.types import Array


@dataclass(frozen=True)
class Estimate:
    """What a tracker says of one frame.

    `pose` (27,), None when no hand was observed; `energy` of Eq. (1) of Oikonomidis et al. 2011 (NaN without a pose);
    `confidence` 0 to 1: the agreement of the rendered hand with the observed one (1 less the skin term of Eq. 2);
    `stage_ms` milliseconds spent in each stage of the tracker.
    """

    pose: Array | None
    energy: float
    confidence: float
    status: Status
    stage_ms: dict[str, float] = field(default_factory=dict)


ABSENT = Estimate(None, float("nan"), 0.0, Status.ABSENT)


class Tracker(Protocol):
    """Follows one hand. What it knows of the past is what its estimates say, so that a run can be resumed."""

    name: str
    stages: tuple[str, ...]
    """Keys of `Estimate.stage_ms`."""

    def start(self, observation: Observation, pose: ArrayLike | None = None) -> Estimate:
        """Begin on this frame: refine a given pose (27,), or find one from the observation alone."""
        ...

    def track(self, observation: Observation) -> Estimate:
        """Follow the hand into the next frame; starts by itself where there is nothing to follow."""
        ...

    def restore(self, estimates: Sequence[Estimate]) -> None:
        """Hear of frames that were estimated before, or had no hand, as if they had been tracked just now.

        A new tracker that recalls the estimates of all frames so far goes on exactly as the one that made them.
        """
        ...

    @property
    def predicted_pose(self) -> Array | None:
        """Where the hand should be in the next frame, as a pose (27,); None where that is not known well."""
        ...

    def close(self) -> None:
        """Free what the tracker holds."""
        ...
