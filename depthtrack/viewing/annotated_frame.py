"""A frame with everything known about it: what pictures and viewers show."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Self

import numpy as np

from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rectangle import Rect
from depthtrack.recording.sequence import Frame, GroundTruth, Sequence
from depthtrack.types import Array, Mask
from depthtrack.viewing.depth_colours import depth_range

MaskEstimator = Callable[[Frame], Mask | None]
"""Finds the hand's silhouette (h, w) in a frame, or None where it sees no hand. Called on frames in their order."""


@dataclass(frozen=True)
class AnnotatedFrame:
    """One frame, the hand's silhouette (h, w) in it, and the true keypoints (21, 3) in metres, camera frame.

    `mask_is_true` tells a silhouette known to the recording from an estimated one.
    """

    frame: Frame
    mask: Mask | None = None
    mask_is_true: bool = False
    keypoints: Array | None = None

    @classmethod
    def of(cls, sequence: Sequence, frame: Frame, estimate: MaskEstimator | None = None) -> Self:
        """A frame of a recording; `estimate` is asked for a mask where the recording knows none.

        Raises DamagedFrameError where the true mask is there and cannot be read.
        """
        true_mask = sequence.hand_mask(frame.index)
        mask = true_mask if true_mask is not None or estimate is None else estimate(frame)
        return cls(frame, mask, true_mask is not None, true_keypoints(sequence.ground_truth, frame.timestamp))

    @property
    def camera(self) -> Camera:
        """Camera of the frame."""
        return self.frame.camera

    def hand_box(self) -> Rect | None:
        """Return the bounding box of the silhouette and the keypoints in sight, None without either."""
        pixels = [np.empty((0, 2))]
        if self.mask is not None:
            pixels.append(np.argwhere(self.mask)[:, ::-1].astype(np.float64))
        if self.keypoints is not None:
            pixels.append(self.camera.project(self.keypoints))
        found = np.concatenate(pixels)
        found = found[np.isfinite(found).all(axis=1)]
        return Rect.around(np.floor(found)) if len(found) else None

    def cropped(self, region: Rect) -> "AnnotatedFrame":
        """Return a region of the frame; what lies outside the image is black and without reading."""
        frame = self.frame
        return AnnotatedFrame(
            Frame(
                frame.index,
                frame.timestamp,
                region.crop(frame.depth),
                None if frame.colour is None else region.crop(frame.colour),
                self.camera.crop(region),
            ),
            None if self.mask is None else region.crop(self.mask),
            self.mask_is_true,
            self.keypoints,
        )


def moments(
    sequence: Sequence, indices: Iterable[int] | None = None, estimate: MaskEstimator | None = None
) -> Iterator[AnnotatedFrame]:
    """Moments of a recording, one at a time: of the frames `indices` in that order, or of all.

    Damaged frames are refused or skipped as was chosen when the recording was opened.
    """
    for frame in sequence.frames(range(len(sequence)) if indices is None else indices):
        yield AnnotatedFrame.of(sequence, frame, estimate)


def true_keypoints(truth: GroundTruth | None, timestamp: float) -> Array | None:
    """The 21 keypoints (21, 3) known at `timestamp`, metres."""
    return None if truth is None else truth.keypoints_at(timestamp)


def evenly_chosen(length: int, count: int) -> list[int]:
    """At most `count` different indices below `length`, in order: the middles of as many equal parts."""
    count = min(length, count)
    return [int((part + 0.5) * length / count) for part in range(count)]


def sequence_depth_range(sequence: Sequence) -> tuple[float, float]:
    """Near and far, metres, of a few frames spread over a recording: one scale for all of its pictures."""
    return depth_range(np.stack([frame.depth for frame in sequence.frames(evenly_chosen(len(sequence), 8))]))
