"""The side of a hand: left or right, by tracking both over a recording.

A flat hand looks like one of the other side seen from its back. Single frames therefore leave the side open. While the
hand moves, the fingers of the wrong hand would have to bend backwards, and its energy rises.
"""

from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass

import numpy as np

from depthtrack.hand.shape import HandShape, Side
from depthtrack.options import option
from depthtrack.recording.sequence import Sequence
from depthtrack.segmentation.options import SegmentationOptions
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.tracking.configuration import HybridConfig, TrackerConfig
from depthtrack.tracking.pipeline import Pipeline, track_frames
from depthtrack.tracking.registry import create_tracker
from depthtrack.types import Array


@dataclass(frozen=True)
class SideOptions:
    """Frames that both sides are tracked in, and the tracker."""

    stretches: int = option(8, "Stretches of the recording, evenly spread")
    stretch_frames: int = option(20, "Frames of each stretch", unit="frames")
    sure_margin: float = option(0.25, "Share by which the other side's energy is higher if the side is certain")
    tracker: TrackerConfig = option(HybridConfig(), "Tracker of both sides")

    def frames(self, length: int) -> list[int]:
        """Return the frames to track of a recording with `length` frames."""
        starts = np.linspace(0, max(0, length - self.stretch_frames), self.stretches).round().astype(int)
        chosen = {index for start in starts for index in range(start, min(length, start + self.stretch_frames))}
        return sorted(map(int, chosen))


DEFAULTS = SideOptions()


@dataclass(frozen=True)
class SideChoice:
    """The side of the lower mean energy; right, and not sure, if no frame shows a hand.

    margin: share by which the mean energy of the other side is higher.
    sure: whether that is enough.
    frames: number of frames that both were tracked in.
    """

    side: Side
    margin: float
    sure: bool
    frames: int


def choose_side(
    sequence: Sequence,
    segmentation: SegmentationOptions | None = None,
    threads: int = 1,
    frames: int | None = None,
    options: SideOptions = DEFAULTS,
    progress: Callable[[int, int], None] | None = None,
) -> SideChoice:
    """Return the side of the hand in a recording, with the average hand of both sides.

    frames: number of first frames to use; all if None.
    progress: called with the number of tracked frames, and of all frames to track.
    """
    hands: dict[Side, HandShape] = {"right": HandShape(), "left": HandShape(side="left")}
    energies = energies_of_sides(sequence, hands, segmentation, threads, frames, options, progress)
    if not len(energies["right"]):
        return SideChoice("right", 0.0, False, 0)
    means = {side: float(values.mean()) for side, values in energies.items()}
    side, other = sorted(means, key=lambda each: means[each])
    margin = means[other] / means[side] - 1
    return SideChoice(side, margin, margin >= options.sure_margin, len(energies[side]))


def energies_of_sides(
    sequence: Sequence,
    hands: Mapping[Side, HandShape],
    segmentation: SegmentationOptions | None = None,
    threads: int = 1,
    frames: int | None = None,
    options: SideOptions = DEFAULTS,
    progress: Callable[[int, int], None] | None = None,
) -> dict[Side, Array]:
    """Return the energies (N,) of hands of both sides, in frames in which both were observed.

    frames: number of first frames to use; all if None.
    progress: called with the number of tracked frames, and of all frames to track.
    """
    indices = options.frames(min(len(sequence), frames or len(sequence)))
    energies = np.full((len(hands), len(indices)), np.nan)
    for row, hand in enumerate(hands.values()):
        segmenter = Segmenter.for_sequence(sequence, segmentation)
        with closing(create_tracker(options.tracker, hand, threads)) as tracker:
            pipeline = Pipeline(tracker, segmenter, hand)
            for column, each in enumerate(track_frames(sequence.frames(indices), pipeline)):
                energies[row, column] = each.estimate.energy
                if progress is not None:
                    progress(row * len(indices) + column + 1, len(hands) * len(indices))
    known = np.isfinite(energies).all(axis=0)
    return {side: energies[row, known] for row, side in enumerate(hands)}
