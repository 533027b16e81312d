"""The backward pass: stretches of doubtful poses are tracked again, backwards in time.

A start at a hand that is hard to see, or a loss, leaves doubtful poses until a clearer view. The first confident pose
after them is followed back through the stretch. There the poses of both directions are known. At one frame the
estimates change from the forward to the backward ones, so that their costs are least.
"""

import math
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple, Protocol

import numpy as np

from depthtrack.errors import InputError
from depthtrack.options import check_ranges, option
from depthtrack.recording.sequence import Frame
from depthtrack.recording.status import Status
from depthtrack.tracking.configuration import HybridConfig, IkConfig, PsoConfig, TrackerConfig
from depthtrack.tracking.pipeline import Pipeline
from depthtrack.tracking.tracker import Estimate

_READ_AT_ONCE = 16
"""Frames that are held in memory to be tracked in reverse order."""


@dataclass(frozen=True)
class BackwardOptions:
    """Stretches that are tracked backwards, and the choice between both directions."""

    doubtful: float = option(0.3, "A stretch with a pose of lower confidence is tracked backwards", most=1)
    confident: float = option(0.5, "Confidence of the poses before and after a stretch", most=1)
    confidence_weight: float = option(
        0.5,
        "Energy that a confidence of 1 makes up for",
        unit="clamp",
        source="tools/tune_backward.py on the tuning seeds 0 to 3 of the cross-model benchmark",
        most=100,
    )
    gain: float = option(
        0.05, "Energy by which a backward pose must be better", unit="clamp", source="as `confidence_weight`", most=100
    )

    def __post_init__(self) -> None:
        check_ranges(self)
        if self.doubtful > self.confident:
            raise InputError(f"doubtful must be at most confident, {self.confident:g}, found {self.doubtful:g}")


def chosen_backward(choice: bool | BackwardOptions | None, tracker: TrackerConfig) -> BackwardOptions | None:
    """Return the options of the backward pass; None for none.

    choice: whether there is one, or its options. By default, the trackers of papers go forward alone, and so does one
        with a deadline. A lift has no direction.

    Raises:
        InputError: the choice is of another type.
    """
    if isinstance(choice, BackwardOptions):
        return choice
    if choice is not None and not isinstance(choice, bool):
        raise InputError(f"backward must be true, false, absent or BackwardOptions, found {choice!r:.40}")
    if choice is None:
        choice = isinstance(tracker, HybridConfig | IkConfig | PsoConfig)
        choice = choice and getattr(tracker, "deadline", None) is None
    return BackwardOptions() if choice else None


class Stretch(NamedTuple):
    """Frames `first` to `anchor - 1`; the pose of the frame `anchor` is confident."""

    first: int
    anchor: int


class ReadFrames(Protocol):
    """Reads frames of a recording."""

    def __call__(self, places: Sequence[int]) -> Iterable[Frame]:
        """Return the frames at some places of the estimates."""
        ...


class BackwardFrame(NamedTuple):
    """A frame that was tracked backwards.

    failure: what failed unexpectedly, in one line; None in a sound frame.
    """

    estimate: Estimate
    milliseconds: float
    failure: str | None


class BackwardPass(NamedTuple):
    """What the backward pass changes, by places.

    estimates: replace forward ones.
    frames: all that were tracked backwards.
    """

    estimates: dict[int, Estimate]
    frames: dict[int, BackwardFrame]


def track_backwards(
    forward: Sequence[Estimate],
    frames: ReadFrames,
    pipeline: Callable[[], Pipeline],
    clamp: float,
    options: BackwardOptions,
    progress: Callable[[int, int], None] | None = None,
) -> BackwardPass:
    """Track the doubtful stretches of a run backwards, and choose between both directions.

    forward: estimates of all frames.
    pipeline: returns a new pipeline, each time with the same tracker, which has tracked nothing before.
    clamp: energy of a pixel that disagrees completely, `Objective.clamp`.
    progress: called with the numbers of frames that are tracked backwards, and that will be.
    """
    stretches = doubtful_stretches(forward, options)
    total = sum(anchor - first for first, anchor in stretches)
    better, found = dict[int, Estimate](), dict[int, BackwardFrame]()
    # The last one first, so that the tracker's time goes on backwards.
    for stretch in reversed(stretches):
        for place, frame in track_stretch(stretch, forward, frames, pipeline()):
            found[place] = frame
            if progress is not None:
                progress(len(found), total)
        places = range(*stretch)
        ahead, back = [forward[place] for place in places], {place: found[place].estimate for place in places}
        change = change_of_direction(ahead, list(back.values()), clamp, options)
        # A frame that has no backward pose, since something failed in it, keeps its forward one.
        better |= {place: back[place] for place in places[change:] if back[place].pose is not None}
        # A frame without a trusted pose has nothing to lose.
        better |= {place: back[place] for place in places[:change] if _is_better_than_none(forward[place], back[place])}
    return BackwardPass(with_forward_status(forward, better), found)


def doubtful_stretches(estimates: Sequence[Estimate], options: BackwardOptions) -> list[Stretch]:
    """Return the stretches between confident poses that hold a doubtful one.

    The last stretch counts only if a confident pose follows it. A frame without a trusted pose is doubtful.
    """
    confidences = [_confidence(each) for each in estimates]
    anchors = [index for index, value in enumerate(confidences) if value >= options.confident]
    stretches = [Stretch(before + 1, anchor) for before, anchor in pairwise([-1, *anchors])]
    return [each for each in stretches if min(confidences[slice(*each)], default=1.0) < options.doubtful]


def track_stretch(
    stretch: Stretch, forward: Sequence[Estimate], frames: ReadFrames, pipeline: Pipeline
) -> Iterator[tuple[int, BackwardFrame]]:
    """Yield each frame of a stretch after its place, last first.

    forward: estimates of all frames.
    pipeline: of a tracker that has followed later stretches at most.
    """
    first, anchor = stretch
    begin = replace(forward[anchor], status=Status.STARTED, timestamp=-forward[anchor].timestamp, branches=())
    known: Estimate | None = begin  # of the anchor alone, which is tracked already
    for place, frame in zip(range(anchor, first - 1, -1), _reversed(frames, first, anchor), strict=True):
        begun = time.perf_counter()
        # Time runs backwards: speeds and pauses are those of a hand that moves so.
        tracked = pipeline.step(replace(frame, timestamp=-frame.timestamp), known)
        if known is None:
            # Branches hold times of this direction, and nothing continues them.
            estimate = replace(tracked.estimate, timestamp=frame.timestamp, branches=())
            yield place, BackwardFrame(estimate, 1e3 * (time.perf_counter() - begun), tracked.failure)
        known = None


def change_of_direction(
    forward: Sequence[Estimate], backward: Sequence[Estimate], clamp: float, options: BackwardOptions
) -> int:
    """Return the number of forward estimates to keep, so that the sum of the costs is least.

    The cost of an estimate is its energy, less a share for its confidence. Backward ones cost `gain` more: they must be
    clearly better.

    clamp: energy of a pixel that disagrees completely, `Objective.clamp`.
    """
    ahead = np.array([_cost(each, clamp, options) for each in forward])
    back = np.array([_cost(each, clamp, options) + options.gain for each in backward])
    before = np.concatenate([[0.0], np.cumsum(ahead)])
    after = np.concatenate([np.cumsum(back[::-1])[::-1], [0.0]])
    # Of equal sums the last one, which keeps most of the forward estimates.
    return len(forward) - int(np.argmin((before + after)[::-1]))


def with_forward_status(forward: Sequence[Estimate], backward: Mapping[int, Estimate]) -> dict[int, Estimate]:
    """Return the backward estimates, by their places, with the status of a forward track.

    A trusted pose after a frame without one starts the track. A forward estimate that started it after a frame that has
    a pose now continues it; it is returned too.
    """
    ordered = dict[int, Estimate]()
    for place, estimate in sorted(backward.items()):
        follows = place > 0 and ordered.get(place - 1, forward[place - 1]).status.is_trusted
        status = Status.TRACKED if follows else Status.STARTED
        ordered[place] = replace(estimate, status=status) if estimate.status.is_trusted else estimate
        after = place + 1
        begins = after < len(forward) and after not in backward and forward[after].status is Status.STARTED
        if begins and estimate.status.is_trusted:
            ordered[after] = replace(forward[after], status=Status.TRACKED)
    return ordered


def _is_better_than_none(forward: Estimate, backward: Estimate) -> bool:
    """Return whether only the backward estimate has a trusted pose."""
    return backward.status.is_trusted and not forward.status.is_trusted


def _confidence(estimate: Estimate) -> float:
    """Return the confidence of a trusted pose; 0 without one, and 1 if it is unknown."""
    if estimate.pose is None or not estimate.status.is_trusted:
        return 0.0
    return 1.0 if math.isnan(estimate.confidence) else estimate.confidence


def _cost(estimate: Estimate, clamp: float, options: BackwardOptions) -> float:
    """Return the cost of an estimate, in multiples of `clamp`; 1 without a pose."""
    if estimate.pose is None:
        return 1.0
    confidence = 0.0 if math.isnan(estimate.confidence) else estimate.confidence
    return min(estimate.energy / clamp, 1.0) - options.confidence_weight * confidence


def _reversed(frames: ReadFrames, first: int, last: int) -> Iterator[Frame]:
    """Yield the frames `last` to `first`; few are in memory at once."""
    for stop in range(last + 1, first, -_READ_AT_ONCE):
        yield from reversed(list(frames(range(max(first, stop - _READ_AT_ONCE), stop))))
