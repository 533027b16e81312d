"""Stretches of a recording that a hand is tracked in, to compare hands or to measure one."""

import math
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from depthtrack.hand.shape import HandShape
from depthtrack.options import option
from depthtrack.recording.read_ahead import read_ahead
from depthtrack.recording.sequence import Sequence
from depthtrack.segmentation.observation import Observation
from depthtrack.segmentation.options import SegmentationOptions
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.tracking.configuration import HybridConfig, TrackerConfig
from depthtrack.tracking.pipeline import Pipeline, track_frames
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
    options = options or StretchOptions()
    indices = options.frames(min(len(sequence), frames or len(sequence)))
    every = max(1, math.ceil(len(indices) / options.views))
    energies, views = np.full(len(indices), np.nan), list[TrackedView]()
    with closing(create_tracker(options.tracker, hand, threads)) as tracker:
        pipeline = Pipeline(tracker, Segmenter.for_sequence(sequence, segmentation), hand)
        for number, each in enumerate(track_frames(read_ahead(sequence.frames(indices), _AHEAD), pipeline)):
            estimate = each.estimate
            energies[number] = estimate.energy
            due = number % every == every - 1
            if due and estimate.status.is_trusted and estimate.pose is not None and each.observation is not None:
                views.append(TrackedView(each.observation, estimate.pose, estimate.energy, estimate.agreement))
            if progress is not None:
                progress(number + 1, len(indices))
    return TrackedStretches(energies, tuple(views))
