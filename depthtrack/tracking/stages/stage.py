"""The stage protocol: trackers are lists of stages."""

from typing import Protocol

from depthtrack.tracking.candidate import Candidate
from depthtrack.tracking.frame import FrameContext


class Stage(Protocol):
    """One step of a tracker: takes candidates, best first, and returns candidates, best first."""

    @property
    def name(self) -> str:
        """Key of the stage's time in `Estimate.stage_ms`."""
        ...

    def __call__(self, frame: FrameContext, candidates: list[Candidate]) -> list[Candidate]: ...
