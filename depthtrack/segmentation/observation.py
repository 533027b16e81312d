"""What a tracker sees of a frame: the hand's skin and depth maps over a region of interest, and its point cloud."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Self

import numpy as np

from depthtrack.geometry.rectangle import Rect
from depthtrack.recording.sequence import Frame, Sequence
from depthtrack.rendering.target import Target
from depthtrack.segmentation.options import SegmentationOptions
from depthtrack.segmentation.point_cloud import point_cloud
from depthtrack.segmentation.roi_tracking import PALM_HALF_THICKNESS, RoiPrior
from depthtrack.segmentation.segmenter import HandLocator, Segmentation
from depthtrack.segmentation.skin_colour import SkinColourModel
from depthtrack.types import Array, Mask


@dataclass(frozen=True)
class Observation(Target):
    """The hand in a frame: a target for scorers, with its place, its palm and its point cloud.

    It is made once a frame and shared by all trackers.
    `region`: of the frame, seen by `camera`.
    `centre` (3,): about the palm's centre, metres, camera frame.
    `palm_radius`: metres.
    `arm_direction` (3,): unit vector from the palm along the forearm, camera frame, None if no arm is seen.
    """

    frame_index: int
    timestamp: float
    region: Rect
    centre: Array
    palm_radius: float
    arm_direction: Array | None = None

    @classmethod
    def of(cls, frame: Frame, found: Segmentation) -> Self:
        """The observation of a frame whose hand was found."""
        depth = np.where(found.readings, frame.depth[found.region.slices], np.float32(0))
        sight = found.centre / np.linalg.norm(found.centre)
        return cls(
            frame.camera.crop(found.region),
            found.skin,
            depth,
            frame.index,
            frame.timestamp,
            found.region,
            found.centre + PALM_HALF_THICKNESS * sight,
            found.palm_radius,
            found.arm_direction,
        )

    def whole_mask(self, shape: tuple[int, ...]) -> Mask:
        """Return the silhouette in the whole frame of `shape` (height, width)."""
        return self.region.paste(self.silhouette, Rect.of_image(shape))

    @property
    def points(self) -> Array:
        """Points (N, 3) of the visible hand in metres, camera frame, row by row of the region."""
        return self._cloud[0]

    @property
    def normals(self) -> Array:
        """Unit normals (N, 3) of the points, towards the camera."""
        return self._cloud[1]

    @cached_property
    def _cloud(self) -> tuple[Array, Array]:
        return point_cloud(self.camera, self.depth)


class Segmenter:
    """Turns frames into observations; remembers where the hand was, as `segmentation.HandLocator` does.

    `skin_model` is used where frames have colour; None uses depth alone. `wrist_margin` (metres) keeps that much of
    the forearm beyond the wrist.
    """

    def __init__(self, skin_model: SkinColourModel | None = None, wrist_margin: float = 0.0) -> None:
        self._segmenter = HandLocator(skin_model, wrist_margin)

    @classmethod
    def for_sequence(cls, sequence: Sequence, options: SegmentationOptions | None = None) -> Self:
        """Return a segmenter that uses skin colour if the recording has colour.

        Raises:
            InputError: the file of skin colours cannot be read.
        """
        return cls.from_options(options or SegmentationOptions(), sequence.has_colour)

    @classmethod
    def from_options(cls, options: SegmentationOptions, has_colour: bool) -> Self:
        """Return a segmenter that uses skin colour if the frames have colour and the options allow it.

        Raises:
            InputError: the file of skin colours cannot be read.
        """
        if not options.use_colour or not has_colour:
            return cls(None, options.wrist_margin)
        file = options.skin_model
        colours = SkinColourModel.default() if file is None else SkinColourModel.load(Path(file))
        return cls(colours, options.wrist_margin)

    def segment(self, frame: Frame, place: RoiPrior | None = None) -> Observation | None:
        """What is seen of the hand, or None without one. `place` is where a tracker is sure to find it."""
        found = self._segmenter.locate(frame, place)
        return None if found is None else Observation.of(frame, found)

    def reset(self) -> None:
        """Forget where the hand was."""
        self._segmenter.reset()
