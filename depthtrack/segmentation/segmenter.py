"""The segmenter: from a frame to the observation of its hand."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Self

import numpy as np

from depthtrack.recording.sequence import Frame, Sequence
from depthtrack.segmentation.flying_pixels import flying_pixels
from depthtrack.segmentation.hand_locator import HandLocator, LocatedHand
from depthtrack.segmentation.hand_size import HandSize
from depthtrack.segmentation.observation import Observation
from depthtrack.segmentation.occluder import find_occluder
from depthtrack.segmentation.options import SegmentationOptions
from depthtrack.segmentation.roi_tracking import RoiPrior, segment_roi
from depthtrack.segmentation.skin_adaptation import AdaptiveSkin
from depthtrack.segmentation.skin_colour import SkinColourModel
from depthtrack.segmentation.skin_of_frame import frame_for_skin, skin_of_frame
from depthtrack.segmentation.surroundings import surroundings_of


class Segmenter:
    """Segments the hand in consecutive frames.

    With a prior, it segments around the predicted hand. Without one, or if no hand is there, it follows the hand from
    its last position or detects it anywhere. The sizes of the hand are those of the last prior, else of the average
    hand.

    skin_model: skin colours, used if frames have colour; None for depth alone.
    options: `use_colour`, `skin_model` and the prior of skin colours are used by `from_options` only.
    """

    def __init__(self, skin_model: SkinColourModel | None = None, options: SegmentationOptions | None = None) -> None:
        self._options = options or SegmentationOptions()
        self._skin = None if skin_model is None else AdaptiveSkin(skin_model, self._options.skin_colour)
        self._locator = HandLocator(self._skin, self._options)

    @classmethod
    def for_sequence(cls, sequence: Sequence, options: SegmentationOptions | None = None) -> Self:
        """Return a segmenter that uses skin colour if the recording has colour.

        Raises:
            InputError: the file of skin colours cannot be read, or the frame that they are taken from shows no hand.
        """
        options = options or SegmentationOptions()
        if options.skin_from is None or not options.use_colour:
            return cls.from_options(options, sequence.has_colour)
        frame = frame_for_skin(sequence, options.skin_from)
        return cls(skin_of_frame(frame, cls(None, options).segment(frame)), options)

    @classmethod
    def from_options(cls, options: SegmentationOptions, has_colour: bool) -> Self:
        """Return a segmenter that uses skin colour if frames have it and the options allow it.

        Raises:
            InputError: the file of skin colours cannot be read.
        """
        if not options.use_colour or not has_colour:
            return cls(None, options)
        if options.skin_model is not None:
            return cls(SkinColourModel.load(Path(options.skin_model)), options)
        return cls(SkinColourModel.default(options.skin_colour.prior), options)

    def segment(self, frame: Frame, prior: RoiPrior | None = None) -> Observation | None:
        """Return the observation of the hand in a frame, or None without one.

        prior: place of the hand by a trusted prediction.
        """
        if prior is not None:
            located = self._near(frame, prior)
            if located is not None:
                wrist = prior.wrist.point + prior.to_surface
                self._locator.set_position(located.surface_centre, wrist, prior.hand, frame.timestamp)
                return self._observation(frame, located, prior.hand)
        located = self._locator.locate(frame)
        return None if located is None else self._observation(frame, located, self._locator.hand)

    def around(self, frame: Frame, prior: RoiPrior) -> Observation | None:
        """Return the observation near a prior, or None with too few readings there; the state stays."""
        located = self._near(frame, prior)
        return None if located is None else self._observation(frame, located, prior.hand)

    def alternatives(self, frame: Frame, first: Observation) -> Iterator[Observation]:
        """Yield other observations of a frame without a prior, which a doubtful start may try.

        first: what `segment` returned. The state stays.
        """
        for located, cost in self._locator.alternatives(frame):
            other = self._observation(frame, located, self._locator.hand)
            if other is not None and not (
                other.region == first.region and np.array_equal(other.silhouette, first.silhouette)
            ):
                yield replace(other, cost=cost, arrived=first.arrived)

    def set_lost(self, lost: bool, timestamp: float) -> None:
        """State whether the tracker lost the hand in the frame of `timestamp` (s).

        After `search.lost_lifetime` the hand is located anew.
        """
        self._locator.set_lost(lost, timestamp)

    def reset(self) -> None:
        """Discard the last position, the sizes of the hand and the adaptation to its colours."""
        self._locator.reset()

    def _near(self, frame: Frame, prior: RoiPrior) -> LocatedHand | None:
        masks = segment_roi(frame, prior, self._skin, self._options)
        if masks is None:
            return None
        radius = float(np.linalg.norm(prior.wrist.point - prior.centre))
        return LocatedHand(masks, prior.centre + prior.to_surface, radius, None, prior.wrist)

    def _observation(self, frame: Frame, located: LocatedHand, hand: HandSize) -> Observation | None:
        """Return the observation of a located hand, or None if it has no reading.

        hand: its sizes.
        """
        masks, occluder = located.masks, None
        skin = None if frame.colour is None else self._skin
        if skin is None:
            valid = ~flying_pixels(frame.depth[masks.region.slices], frame.camera.fx, self._options.flying_pixels)
            masks = replace(masks, readings=masks.readings & valid, silhouette=masks.silhouette & valid)
        if not masks.readings.any():
            return None
        if skin is not None and self._options.occluder.find_occluder:
            place = located.surface_centre, located.wrist, hand
            occluder = find_occluder(frame, masks, *place, self._options.occluder)
        sight = located.surface_centre / np.linalg.norm(located.surface_centre)
        return Observation(
            camera=frame.camera.crop(masks.region),
            frame_camera=frame.camera,
            silhouette=masks.silhouette,
            depth=np.where(masks.readings, frame.depth[masks.region.slices], np.float32(0)),
            frame_index=frame.index,
            timestamp=frame.timestamp,
            region=masks.region,
            centre=located.surface_centre + hand.palm_half_thickness * sight,
            palm_radius=located.palm_radius,
            arm_direction=located.arm_direction,
            wrist=located.wrist,
            cloud_options=self._options.point_cloud,
            occluder=occluder,
            surroundings=surroundings_of(frame, masks, skin, float(located.surface_centre[2])),
            keypoints=None if frame.keypoints is None else frame.keypoints.shifted(*masks.region[:2]),
        )
