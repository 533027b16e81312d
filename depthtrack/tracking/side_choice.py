"""The side of a hand: left or right, by tracking both over a recording.

A flat hand looks like one of the other side seen from its back. Single frames therefore leave the side open. While the
hand moves, the fingers of the wrong hand would have to bend backwards, and its energy rises.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from depthtrack.hand.shape import HandShape, Side
from depthtrack.options import option
from depthtrack.recording.sequence import Sequence
from depthtrack.segmentation.options import SegmentationOptions
from depthtrack.tracking.stretches import Starts, StretchOptions, TrackedStretches, TrackedView, track_hands
from depthtrack.types import Array


@dataclass(frozen=True)
class SideOptions:
    """Frames that both sides are tracked in, and the margin of a certain side."""

    stretches: StretchOptions = option(StretchOptions(anew=True), "Frames that both sides are tracked in")
    sure_margin: float = option(0.25, "Share by which the other side's energy is higher if the side is certain")


DEFAULTS = SideOptions()
_MOST = 1.5
"""Multiple of its median that an energy counts as at most. A track of the right side may have begun wrong."""


@dataclass(frozen=True)
class SideChoice:
    """The side of the lower mean energy; right, and not sure, if no frame shows a hand.

    margin: share by which the mean energy of the other side is higher.
    sure: whether that is enough.
    frames: number of frames that both were tracked in.
    views: poses of the tracked hand of each side.
    starts: estimates of them to begin stretches with.
    """

    side: Side
    margin: float
    sure: bool
    frames: int
    views: Mapping[Side, tuple[TrackedView, ...]] = field(default_factory=dict, repr=False, compare=False)
    starts: Mapping[Side, Starts] = field(default_factory=dict, repr=False, compare=False)


def choose_side(
    sequence: Sequence,
    segmentation: SegmentationOptions | None = None,
    threads: int = 1,
    frames: int | None = None,
    options: SideOptions = DEFAULTS,
    progress: Callable[[int, int], None] | None = None,
    scales: Mapping[Side, float] | None = None,
) -> SideChoice:
    """Return the side of the hand in a recording, by hands of average proportions.

    frames: number of first frames to use; all if None.
    progress: called with the number of tracked frames, and of all frames to track.
    scales: of these hands; 1 if None.
    """
    sides: tuple[Side, ...] = ("right", "left")
    hands = {side: HandShape(side=side, scale=scales[side] if scales else 1.0) for side in sides}
    tracked = track_sides(sequence, hands, segmentation, threads, frames, options.stretches, progress)
    views = {side: each.views for side, each in tracked.items()}
    starts = {side: each.starts for side, each in tracked.items()}
    means, count = mean_energies({side: each.energies for side, each in tracked.items()})
    if count == 0:
        return SideChoice("right", 0.0, False, 0, views, starts)
    side, other = sorted(means, key=lambda each: means[each])
    margin = means[other] / means[side] - 1
    return SideChoice(side, margin, margin >= options.sure_margin, count, views, starts)


def track_sides(
    sequence: Sequence,
    hands: Mapping[Side, HandShape],
    segmentation: SegmentationOptions | None = None,
    threads: int = 1,
    frames: int | None = None,
    options: StretchOptions | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> dict[Side, TrackedStretches]:
    """Return the stretches of a recording tracked with hands of both sides.

    frames: number of first frames to use; all if None.
    progress: called with the number of tracked frames, and of all frames to track.
    """

    found = track_hands(sequence, hands.values(), segmentation, threads, frames, options, progress)
    return dict(zip(hands, found, strict=True))


def mean_energies(tracked: Mapping[Side, Array]) -> tuple[dict[Side, float], int]:
    """Return the mean energy of each side, and the number of frames with both poses.

    tracked: energies (N,) of each side in the same frames; NaN without a pose. Such frames do not count. Energies far
        above the median count less.
    """
    energies: Array = np.array(list(tracked.values()))
    known = np.isfinite(energies).all(axis=0)
    if not known.any():
        return dict.fromkeys(tracked, np.inf), 0
    energies = energies[:, known]
    means = np.minimum(energies, _MOST * np.median(energies, axis=1, keepdims=True)).mean(axis=1).tolist()
    return dict(zip(tracked, means, strict=True)), int(known.sum())
