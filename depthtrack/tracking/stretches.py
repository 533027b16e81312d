"""Stretches of a recording that a hand is tracked in, to compare hands or to measure one."""

import math
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing
from dataclasses import dataclass
from functools import partial
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
from depthtrack.types import Array

_AHEAD = 2
"""Frames that are read while another one is tracked."""


@dataclass(frozen=True)
class StretchOptions:
    """Frames of a recording to track, and the tracker."""

    stretches: int = option(8, "Stretches of the recording, evenly spread")
    stretch_frames: int = option(20, "Frames of each stretch", unit="frames")
    views: int = option(32, "Frames kept as views, at most, evenly spread over those", unit="frames")
    tracker: TrackerConfig = option(HybridConfig(), "Tracker")

    def frames(self, length: int) -> list[int]:
        """Return the frames to track of a recording with `length` frames."""
        starts = np.linspace(0, max(0, length - self.stretch_frames), self.stretches).round().astype(int)
        chosen = {index for start in starts for index in range(start, min(length, start + self.stretch_frames))}
        return sorted(map(int, chosen))


class TrackedView(NamedTuple):
    """Observation of a frame, and the pose (27,) tracked in it, with its scores."""

    observation: Observation
    pose: Array
    energy: float
    agreement: float


class TrackedStretches(NamedTuple):
    """Result of a hand in the stretches of a recording.

    energies: (N,) of all frames; NaN without a hand.
    views: trusted poses in some of them.
    """

    energies: Array
    views: tuple[TrackedView, ...]


def track_stretches(
    sequence: Sequence,
    hand: HandShape,
    segmentation: SegmentationOptions | None = None,
    threads: int = 1,
    frames: int | None = None,
    options: StretchOptions | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> TrackedStretches:
    """Track a hand in the stretches of a recording.

    frames: number of first frames to use; all if None.
    progress: called with the number of tracked frames, and of all frames to track.
    """
    return track_hands(sequence, [hand], segmentation, threads, frames, options, progress)[0]


def track_hands(
    sequence: Sequence,
    hands: Iterable[HandShape],
    segmentation: SegmentationOptions | None = None,
    threads: int = 1,
    frames: int | None = None,
    options: StretchOptions | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[TrackedStretches]:
    """Track several hands in the same stretches of a recording, side by side.

    Each frame is read once. What is found for a hand depends neither on the others nor on the number of threads.

    The other arguments are those of `track_stretches`.
    """
    options = options or StretchOptions()
    indices = options.frames(min(len(sequence), frames or len(sequence)))
    with ExitStack() as stack:
        tracked = list[_Tracked]()
        for hand in hands:
            tracker = stack.enter_context(closing(create_tracker(options.tracker, hand, threads)))
            pipeline = Pipeline(tracker, Segmenter.for_sequence(sequence, segmentation), hand)
            tracked.append(_Tracked(pipeline, len(indices), max(1, math.ceil(len(indices) / options.views))))
        pool = stack.enter_context(ThreadPoolExecutor(min(threads, len(tracked)), "hands"))
        for number, frame in enumerate(read_ahead(sequence.frames(indices), _AHEAD)):
            list(pool.map(partial(_Tracked.step, frame=frame, number=number), tracked))
            if progress is not None:
                progress(number + 1, len(indices))
    return [TrackedStretches(each.energies, tuple(each.views)) for each in tracked]


def refine_views(
    views: Iterable[TrackedView], hand: HandShape, config: TrackerConfig, threads: int = 1
) -> tuple[TrackedView, ...]:
    """Fit the poses of views to a hand of other sizes, without the frames between them.

    Observations stay those of the hand that was tracked.
    """
    refined = list[TrackedView]()
    with closing(create_tracker(config, hand, threads)) as tracker:
        for view in views:
            found = tracker.start(view.observation, view.pose)
            if found.pose is not None:
                refined.append(TrackedView(view.observation, found.pose, found.energy, found.agreement))
    return tuple(refined)


class _Tracked:
    """Results of one hand so far.

    count: number of frames.
    every: every n-th frame may become a view.
    """

    def __init__(self, pipeline: Pipeline, count: int, every: int) -> None:
        self._pipeline, self._every = pipeline, every
        self.energies, self.views = np.full(count, np.nan), list[TrackedView]()

    def step(self, frame: Frame, number: int) -> None:
        """Track the hand in the next frame."""
        tracked = self._pipeline.step(frame)
        estimate, observation = tracked.estimate, tracked.observation
        self.energies[number] = estimate.energy
        due = number % self._every == self._every - 1
        if due and estimate.status.is_trusted and estimate.pose is not None and observation is not None:
            self.views.append(TrackedView(observation, estimate.pose, estimate.energy, estimate.agreement))
