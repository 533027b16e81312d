"""Frames with their silhouette and keypoints, for pictures and viewers."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Self

import numpy as np

from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rectangle import Rect
from depthtrack.recording.sequence import Frame, Sequence
from depthtrack.types import Array, Mask
from depthtrack.viewing.depth_colours import depth_range

MaskEstimator = Callable[[Frame], Mask | None]
"""Returns the hand's silhouette (h, w) in a frame, None without a hand; called on frames in order."""


@dataclass(frozen=True)
class AnnotatedFrame:
    """A frame with the hand's silhouette and keypoints, if known.

    mask (h, w): silhouette.
    mask_is_true: whether the silhouette is ground truth instead of an estimate.
    keypoints (21, 3): metres, camera frame.
    occluder (h, w): object that may hide the hand.
    """

    frame: Frame
    mask: Mask | None = None
    mask_is_true: bool = False
    keypoints: Array | None = None
    occluder: Mask | None = None

    @classmethod
    def of(cls, sequence: Sequence, frame: Frame, estimate: MaskEstimator | None = None) -> Self:
        """Annotate a frame of a recording; `estimate` returns the mask if there is no true one.

        Raises: DamagedFrameError if the true mask cannot be read.
        """
        true_mask = sequence.hand_mask(frame.index)
        mask = true_mask if true_mask is not None or estimate is None else estimate(frame)
        return cls(frame, mask, true_mask is not None, true_keypoints(sequence, frame.timestamp))

    @property
    def camera(self) -> Camera:
        """Return the frame's camera."""
        return self.frame.camera

    def hand_box(self) -> Rect | None:
        """Return the bounding box of silhouette and projected keypoints; None without both."""
        pixels = [np.empty((0, 2))]
        if self.mask is not None:
            pixels.append(np.argwhere(self.mask)[:, ::-1].astype(np.float64))
        if self.keypoints is not None:
            pixels.append(self.camera.project(self.keypoints))
        found = np.concatenate(pixels)
        found = found[np.isfinite(found).all(axis=1)]
        return Rect.around(np.floor(found)) if len(found) else None

    def cropped(self, region: Rect) -> "AnnotatedFrame":
        """Return a region of the frame; pixels outside the image are black, without depth."""
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
            None if self.occluder is None else region.crop(self.occluder),
        )


def annotated_frames(
    sequence: Sequence, indices: Iterable[int] | None = None, estimate: MaskEstimator | None = None
) -> Iterator[AnnotatedFrame]:
    """Yield annotated frames of a recording: those of `indices` in that order, or all.

    The sequence rejects or skips damaged frames, as chosen when it was opened.
    """
    for frame in sequence.frames(range(len(sequence)) if indices is None else indices):
        yield AnnotatedFrame.of(sequence, frame, estimate)


def true_keypoints(sequence: Sequence, timestamp: float) -> Array | None:
    """Return the true keypoints (21, 3) at a time, metres, camera frame; None if unknown."""
    truth, T = sequence.ground_truth, sequence.T_camera_world
    keypoints = None if truth is None else truth.keypoints_at(timestamp)
    return None if keypoints is None else keypoints @ T[:3, :3].T + T[:3, 3]


def evenly_spaced(length: int, count: int) -> list[int]:
    """Return at most `count` increasing indices below `length`: the middles of equal parts."""
    count = min(length, count)
    return [int((part + 0.5) * length / count) for part in range(count)]


def sequence_depth_range(sequence: Sequence) -> tuple[float, float]:
    """Return near and far (metres) of evenly spaced frames: one colour scale for a recording."""
    return depth_range(np.stack([frame.depth for frame in sequence.frames(evenly_spaced(len(sequence), 8))]))
