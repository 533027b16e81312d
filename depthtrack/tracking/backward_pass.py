"""The backward pass: stretches of doubtful poses are tracked again, backwards in time.

A start at a hand that is hard to see, or a loss, leaves doubtful poses until a clearer view. The first confident pose
after them is followed back through the stretch. There the poses of both directions are known. At one frame the
estimates change from the forward to the backward ones, so that their costs are least.
"""

import math
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple, Protocol

from depthtrack.recording.sequence import Frame
from depthtrack.recording.status import Status
from depthtrack.tracking.backward_options import BackwardOptions
from depthtrack.tracking.change_of_direction import Motion, change_of_direction
from depthtrack.tracking.pipeline import Pipeline
from depthtrack.tracking.tracker import Estimate
from depthtrack.types import Array

_READ_AT_ONCE = 16
"""Frames that are held in memory to be tracked in reverse order."""


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
    keypoints: Callable[[Array], Array],
    clamp: float,
    options: BackwardOptions,
    progress: Callable[[int, int], None] | None = None,
) -> BackwardPass:
    """Track the doubtful stretches of a run backwards, and choose between both directions.

    forward: estimates of all frames.
    pipeline: returns a new pipeline, each time with the same tracker, which has tracked nothing before.
    keypoints: returns those of a pose, metres.
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
        back = {place: found[place].estimate for place in places}
        motion = motion_of(stretch, forward, back, keypoints, options)
        change = change_of_direction(forward[slice(*stretch)], list(back.values()), motion, clamp, options)
        # A frame that has no backward pose, since something failed in it, keeps its forward one.
        better |= {place: back[place] for place in places[change:] if back[place].pose is not None}
        # A frame without a trusted pose has nothing to lose.
        better |= {place: back[place] for place in places[:change] if _is_better_than_none(forward[place], back[place])}
    return BackwardPass(with_forward_status(forward, better), found)


def doubtful_stretches(estimates: Sequence[Estimate], options: BackwardOptions) -> list[Stretch]:
    """Return the stretches between confident poses that hold a doubtful one.

    The last stretch counts only if a confident pose follows it. A frame without a trusted pose is doubtful. A stretch
    begins after its last pause: a hand is not followed through one.
    """
    confidences = [_confidence(each) for each in estimates]
    stretches, first = list[Stretch](), 0
    for index, value in enumerate(confidences):
        if _is_after_pause(estimates, index, options):
            first = index
        if value >= options.confident:
            stretches.append(Stretch(first, index))
            first = index + 1
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


def motion_of(
    stretch: Stretch,
    forward: Sequence[Estimate],
    backward: Mapping[int, Estimate],
    keypoints: Callable[[Array], Array],
    options: BackwardOptions,
) -> Motion:
    """Return the motion of both directions in a stretch.

    forward: estimates of all frames.
    backward: of the frames of the stretch, by their places.
    keypoints: returns those of a pose, metres.
    """
    first, anchor = stretch
    before = None if first == 0 or _is_after_pause(forward, first, options) else forward[first - 1]
    back = [backward[place] for place in range(first, anchor)]
    return Motion.between(forward[first:anchor], back, (before, forward[anchor]), keypoints)


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


def _is_after_pause(estimates: Sequence[Estimate], place: int, options: BackwardOptions) -> bool:
    """Return whether the frame of an estimate is the first one after a pause."""
    return place > 0 and estimates[place].timestamp - estimates[place - 1].timestamp > options.pause


def _is_better_than_none(forward: Estimate, backward: Estimate) -> bool:
    """Return whether only the backward estimate has a trusted pose."""
    return backward.status.is_trusted and not forward.status.is_trusted


def _confidence(estimate: Estimate) -> float:
    """Return the confidence of a trusted pose; 0 without one, and 1 if it is unknown."""
    if estimate.pose is None or not estimate.status.is_trusted:
        return 0.0
    return 1.0 if math.isnan(estimate.confidence) else estimate.confidence


def _reversed(frames: ReadFrames, first: int, last: int) -> Iterator[Frame]:
    """Yield the frames `last` to `first`; few are in memory at once."""
    for stop in range(last + 1, first, -_READ_AT_ONCE):
        yield from reversed(list(frames(range(max(first, stop - _READ_AT_ONCE), stop))))
