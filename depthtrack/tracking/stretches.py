"""Stretches of a recording that a hand is tracked in, to compare hands or to measure one."""

import math
from bisect import bisect_right
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack, closing
from dataclasses import dataclass
from functools import partial
from itertools import groupby, pairwise
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from depthtrack.hand.shape import HandShape
from depthtrack.options import option
from depthtrack.recording.read_ahead import read_ahead
from depthtrack.recording.sequence import Frame, Sequence
from depthtrack.segmentation.observation import Observation
from depthtrack.segmentation.options import SegmentationOptions
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.tracking.configuration import HybridConfig, TrackerConfig
from depthtrack.tracking.pipeline import Pipeline
from depthtrack.tracking.registry import create_tracker
from depthtrack.tracking.tracker import Estimate
from depthtrack.types import Array

_AHEAD = 2
"""Frames that are read while another one is tracked."""
Starts = Mapping[int, tuple[Estimate, ...]]
"""Estimates that tracks of stretches may begin with, by the first frames of these stretches."""
_NO_STARTS: Starts = MappingProxyType({})


@dataclass(frozen=True)
class StretchOptions:
    """Frames of a recording to track, and the tracker."""

    stretches: int = option(8, "Stretches of the recording, evenly spread")
    stretch_frames: int = option(20, "Frames of each stretch", unit="frames")
    views: int = option(32, "Frames kept as views, at most, evenly spread over those", unit="frames")
    anew: bool = option(False, "Begin each stretch anew too; the track of the lower energy goes on")
    tracker: TrackerConfig = option(HybridConfig(), "Tracker")

    def ranges(self, length: int) -> list[range]:
        """Return the stretches of a recording with `length` frames, in order.

        A short recording is divided evenly.
        """
        if length <= self.stretches * self.stretch_frames:
            ends = np.unique(np.linspace(0, length, self.stretches + 1).round().astype(int)).tolist()
            return [range(*pair) for pair in pairwise(ends)]
        starts = np.linspace(0, length - self.stretch_frames, self.stretches).round().astype(int).tolist()
        return [range(start, start + self.stretch_frames) for start in starts]

    def frames(self, length: int) -> list[int]:
        """Return the frames to track of a recording with `length` frames."""
        return [index for each in self.ranges(length) for index in each]


class TrackedView(NamedTuple):
    """Observation of a frame, and the pose (27,) tracked in it, with its scores."""

    observation: Observation
    pose: Array
    energy: float
    agreement: float


class TrackedStretches(NamedTuple):
    """Result of a hand in the stretches of a recording.

    energies: (N,) of all frames, see `Estimate.comparable_energy`; NaN without a hand.
    views: trusted poses in some of them.
    starts: trusted estimates of the first frames of stretches, by frame.
    """

    energies: Array
    views: tuple[TrackedView, ...]
    starts: Starts = _NO_STARTS


def track_stretches(
    sequence: Sequence,
    hand: HandShape,
    segmentation: SegmentationOptions | None = None,
    threads: int = 1,
    frames: int | None = None,
    options: StretchOptions | None = None,
    progress: Callable[[int, int], None] | None = None,
    starts: Starts = _NO_STARTS,
    read: Callable[[Iterable[int]], Iterable[Frame]] | None = None,
) -> TrackedStretches:
    """Track a hand in the stretches of a recording.

    frames: number of first frames to use; all if None.
    progress: called with the number of tracked frames, and of all frames to track.
    starts: estimates to begin stretches with; that of the lowest energy in the first frame is used. Stretches without
        any go on with the track before them.
    read: returns the frames of the recording with some indices; None to decode them.
    """
    return track_hands(sequence, [hand], segmentation, threads, frames, options, progress, [starts], read)[0]


def track_hands(
    sequence: Sequence,
    hands: Iterable[HandShape],
    segmentation: SegmentationOptions | None = None,
    threads: int = 1,
    frames: int | None = None,
    options: StretchOptions | None = None,
    progress: Callable[[int, int], None] | None = None,
    starts: Iterable[Starts] = (),
    read: Callable[[Iterable[int]], Iterable[Frame]] | None = None,
) -> list[TrackedStretches]:
    """Track several hands in the same stretches of a recording, side by side.

    Each frame is read once. Threads share hands and stretches. What is found for a hand depends neither on the others
    nor on the number of threads.

    starts: see `track_stretches`; of each hand.
    The other arguments are those of `track_stretches`.
    """
    options, hands, known = options or StretchOptions(), list(hands), list(starts)
    ranges = options.ranges(min(len(sequence), frames or len(sequence)))
    first, indices = [each.start for each in ranges], [index for each in ranges for index in each]
    every, done, waiting = max(1, math.ceil(len(indices) / options.views)), 0, deque[list[Future[int]]]()
    parallel = len(hands) * (len(ranges) if any(known) else 1)
    with ExitStack() as stack:

        def begun(hand: HandShape) -> Pipeline:
            tracker = create_tracker(options.tracker, hand, max(1, threads // parallel))
            stack.callback(tracker.close)
            return Pipeline(tracker, Segmenter.for_sequence(sequence, segmentation), hand)

        pool = stack.enter_context(ThreadPoolExecutor(threads, "stretches"))
        tracked = [
            _Tracked(partial(begun, hand), known[number] if known else _NO_STARTS, every, options.anew)
            for number, hand in enumerate(hands)
        ]

        def finish(most: int) -> None:
            nonlocal done
            while len(waiting) > most:
                finished, *_ = [job.result() for job in waiting.popleft()]
                done += finished
                if progress is not None:
                    progress(done, len(indices))

        reader = read_ahead((read or sequence.frames)(indices), _AHEAD)
        for _, stretch in groupby(reader, lambda frame: bisect_right(first, frame.index)):
            images = list(stretch)
            waiting.append([hand.submit(images, pool) for hand in tracked])
            finish(threads)
        finish(0)
    return [each.found() for each in tracked]


def refine_views(
    views: Iterable[TrackedView], hand: HandShape, config: TrackerConfig, threads: int = 1
) -> tuple[TrackedView, ...]:
    """Fit the poses of views to a hand of other sizes, without the frames between them.

    Observations stay those of the hand that was tracked.
    """

    def refined(view: TrackedView) -> TrackedView | None:
        with closing(create_tracker(config, hand)) as tracker:
            found = tracker.start(view.observation, view.pose)
        if found.pose is None:
            return None
        return TrackedView(view.observation, found.pose, found.energy, found.agreement)

    with ThreadPoolExecutor(threads, "views") as pool:
        return tuple(view for view in pool.map(refined, views) if view is not None)


class _Stretch(NamedTuple):
    """Result of a hand in one stretch; see `TrackedStretches`.

    estimates: of all its frames.
    frames: its frames, the first one and the last one.
    ends: trusted estimates in them, None without.
    """

    estimates: list[Estimate]
    views: list[TrackedView]
    frames: tuple[int, int]
    ends: list[Estimate | None]


class _Tracked:
    """Track of one hand, stretch by stretch.

    begun: returns a new pipeline.
    starts: estimates to begin stretches with.
    every: every n-th frame may become a view.
    anew: whether each stretch begins anew too.
    """

    def __init__(self, begun: Callable[[], Pipeline], starts: Starts, every: int, anew: bool) -> None:
        self._begun, self._starts, self._every, self._anew = begun, starts, every, anew
        self._stretches, self._frames = list[_Stretch](), 0
        self._pipeline: Pipeline | None = None
        self._before: Future[int] | None = None

    def submit(self, frames: list[Frame], pool: ThreadPoolExecutor) -> Future[int]:
        """Track the next stretch in a thread; the result is the number of its frames."""
        starts, stretch = (
            self._starts.get(frames[0].index, ()),
            _Stretch([], [], (frames[0].index, frames[-1].index), []),
        )
        if self._pipeline is None or starts:
            self._pipeline, self._before = self._begun(), None
        last = self._stretches[-1] if self._before is not None else None
        self._before = pool.submit(
            self._track, self._pipeline, frames, self._frames, stretch, self._before, starts, last
        )
        self._stretches.append(stretch)
        self._frames += len(frames)
        return self._before

    def _track(
        self,
        pipeline: Pipeline,
        frames: list[Frame],
        first: int,
        stretch: _Stretch,
        before: Future[int] | None,
        starts: tuple[Estimate, ...],
        last: _Stretch | None,
    ) -> int:
        """Track the hand in frames, the first one with this number, if those before are finished.

        last: the stretch that the track goes on from, if any.
        """
        if before is not None:
            before.result()
        if self._anew and last is not None:
            starts = (last.estimates[-1], self._begun().step(frames[0]).estimate)
        if starts:
            pipeline.restore([self._best(starts, frames[0])])
        for number, frame in enumerate(frames, first):
            tracked = pipeline.step(frame)
            estimate, observation = tracked.estimate, tracked.observation
            stretch.estimates.append(estimate)
            trusted = estimate if estimate.status.is_trusted else None
            if frame.index in stretch.frames:
                stretch.ends.append(trusted)
            due = number % self._every == self._every - 1
            if due and trusted is not None and trusted.pose is not None and observation is not None:
                stretch.views.append(TrackedView(observation, trusted.pose, trusted.energy, trusted.agreement))
        return len(frames)

    def _best(self, starts: tuple[Estimate, ...], frame: Frame) -> Estimate:
        """Return the estimate that the track of the lowest energy in a frame begins with."""
        if len(starts) == 1:
            return starts[0]
        energies = list[float]()
        for start in starts:
            pipeline = self._begun()
            pipeline.restore([start])
            energies.append(pipeline.step(frame).estimate.comparable_energy)
        return starts[int(np.argmin(np.nan_to_num(energies, nan=np.inf)))]

    def found(self) -> TrackedStretches:
        """Return the results of the finished stretches."""
        energies = np.array([estimate.comparable_energy for each in self._stretches for estimate in each.estimates])
        views = tuple(view for each in self._stretches for view in each.views)
        starts = {each.frames[0]: [each.ends[0]] for each in self._stretches}
        for one, other in pairwise(self._stretches):
            if other.frames[0] == one.frames[1] + 1:
                starts[other.frames[0]].append(one.ends[-1])
        known = {frame: tuple(each for each in found if each is not None) for frame, found in starts.items()}
        return TrackedStretches(energies, views, {frame: found for frame, found in known.items() if found})
