"""The recording that a hand is calibrated on, and the views of the hand in it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from depthtrack.calibration.acceptance import check_resembles_hand
from depthtrack.calibration.options import CalibrationOptions
from depthtrack.errors import InputError
from depthtrack.hand.shape import HandShape
from depthtrack.recording import sequence as recording
from depthtrack.recording.kept_frames import KeptFrames
from depthtrack.segmentation.options import SegmentationOptions
from depthtrack.tracking.configuration import TrackerConfig
from depthtrack.tracking.stretches import (
    Starts,
    StretchOptions,
    TrackedStretches,
    TrackedView,
    refine_views,
    track_stretches,
)


@dataclass(frozen=True)
class CalibrationSource:
    """A recording, and how it is tracked.

    frames: number of first frames to use; all if None.
    """

    sequence: recording.Sequence
    segmentation: SegmentationOptions | None
    seed: int
    threads: int
    frames: int | None
    options: CalibrationOptions

    def tracked(self, hand: HandShape, progress: Callable[[int, int], None], starts: Starts) -> TrackedStretches:
        """Return views and energies of a hand that is tracked in stretches.

        starts: estimates to begin them with.
        """
        return track_stretches(
            self.sequence,
            hand,
            self.segmentation,
            self.threads,
            self.frames,
            self._stretches,
            progress,
            starts,
            self.kept.frames,
        )

    @cached_property
    def kept(self) -> KeptFrames:
        """The frames, which each track reads again."""
        return KeptFrames(self.sequence)

    @property
    def first_frames(self) -> list[int]:
        """The first frames of the stretches."""
        length = min(len(self.sequence), self.frames or len(self.sequence))
        return [each.start for each in self.options.stretches.ranges(length)]

    def refined(self, views: Sequence[TrackedView], hand: HandShape) -> Sequence[TrackedView]:
        """Return views with the poses of another hand, fitted from theirs."""
        return refine_views(views, hand, self.tracker, self.threads)

    @property
    def tracker(self) -> TrackerConfig:
        """The tracker with the seed of the calibration."""
        return replace(self.options.stretches.tracker, seed=self.seed)

    @property
    def _stretches(self) -> StretchOptions:
        return replace(self.options.stretches, tracker=self.tracker)

    def check(self, views: Sequence[TrackedView]) -> None:
        """Check that enough views show a hand.

        Raises:
            InputError: if they do not.
        """
        options = self.options
        if len(views) < options.fewest:
            raise InputError(
                f"a hand was tracked in {len(views)} of {min(len(self.sequence), options.stretches.views)} frames of "
                f"{self.sequence.name}: calibrating needs at least {options.fewest} frames that show a bare hand, "
                "best with open fingers towards the camera"
            )
        check_resembles_hand([each.agreement for each in views], options.accepted.hand_like)
