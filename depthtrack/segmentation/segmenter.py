"""The hand in a frame: start anywhere, then follow it from its last position (Oikonomidis et al. 2011, Sec. 2.1)."""

from dataclasses import dataclass, replace

import numpy as np

from depthtrack.geometry.rectangle import Rect
from depthtrack.recording.sequence import Frame
from depthtrack.segmentation.flying_pixels import flying_pixels
from depthtrack.segmentation.forearm import Arm, find_arm, find_vanishing_arm
from depthtrack.segmentation.hand_detection import find_start, nearest_palm
from depthtrack.segmentation.palm import Palm
from depthtrack.segmentation.pixel_labels import hand_masks, label_hand
from depthtrack.segmentation.roi_tracking import PALM_HALF_THICKNESS, RoiPrior, segment_roi
from depthtrack.segmentation.skin_adaptation import AdaptiveSkin
from depthtrack.segmentation.skin_colour import SkinColourModel
from depthtrack.segmentation.surface_grid import SurfaceGrid, blind_skin, build_grid
from depthtrack.segmentation.wrist import WristPlane, arm_nodes, find_wrist, hand_axis, palm_centre
from depthtrack.segmentation.wrist_filter import WristFilter
from depthtrack.types import Array, Mask

DEPTH_WINDOW = 0.25
"""Metres around the last position that are searched (ibid.)."""

NEAREST, FARTHEST = 0.1, 2.75
"""Metres from the camera at which a hand is looked for; the paper tracks up to 2.5 m."""

NODE_SIZE = 0.005
"""Metres that a grid node spans: a third of a finger's breadth."""

START_COLUMNS = 160
"""Nodes across the image when nothing is known of the hand's distance."""

MEMORY = 0.5
"""Seconds for which the last position is worth something: a hand crosses the window in less."""


@dataclass(frozen=True)
class Segmentation:
    """A hand found in a frame. Masks cover `region` of the frame, which leaves room around the hand.

    `skin` (h, w) the hand's silhouette; `readings` (h, w) where the depth is the hand's; `centre` (3,) of the palm on
    the visible surface, metres, camera frame; `palm_radius` of the circle inscribed in it; `arm_direction` (3,) unit,
    from the palm along the forearm, or None where no arm is seen or looked for; `wrist` the plane of the cut, if any.
    """

    region: Rect
    skin: Mask
    readings: Mask
    centre: Array
    palm_radius: float
    arm_direction: Array | None
    wrist: WristPlane | None


class HandLocator:
    """Finds the hand frame after frame. Remembers only where hand and wrist were last, and the colours around them.

    `skin_model` is used where frames have colour; None uses depth alone. `wrist_margin` (metres) keeps that much of
    the forearm beyond the wrist.
    """

    def __init__(self, skin_model: SkinColourModel | None = None, wrist_margin: float = 0.0) -> None:
        self._skin = None if skin_model is None else AdaptiveSkin(skin_model)
        self._wrist = WristFilter()
        self._wrist_margin = wrist_margin
        self._last: Array | None = None
        self._last_time = 0.0
        self._arm_direction: Array | None = None

    def reset(self) -> None:
        """Forget where the hand was, and what the recording's colours were."""
        self._last = None
        self._forget_arm()
        if self._skin is not None:
            self._skin.forget()

    def locate(self, frame: Frame, place: RoiPrior | None = None) -> Segmentation | None:
        """The hand, or None where none is seen. `place` is where a tracker is sure to find it: nothing is searched."""
        guided = None if place is None else self._guided(frame, place)
        if guided is not None:
            return self._without_flying(frame, guided)
        if not 0 <= frame.timestamp - self._last_time <= MEMORY:
            self._last = None
        found = None if self._last is None else self._follow(frame, self._last)
        if found is None:
            self._forget_arm()
            start = self._start(frame)
            found = None if start is None else self._follow(frame, start)
        if found is None:
            return None
        self._last_time = frame.timestamp
        return self._without_flying(frame, found)

    def _guided(self, frame: Frame, place: RoiPrior) -> Segmentation | None:
        masks = segment_roi(frame, place, self._skin)
        if masks is None:
            return None
        to_surface = -PALM_HALF_THICKNESS * place.centre / np.linalg.norm(place.centre)
        self._last, self._last_time = place.centre + to_surface, frame.timestamp
        # Should the tracker lose the hand, it is found from here on; of the forearm, a hand tells nothing.
        self._arm_direction = None
        self._wrist.expect(place.wrist.point + to_surface)
        radius = float(np.linalg.norm(place.wrist.point - place.centre))
        return Segmentation(masks.region, masks.skin, masks.readings, self._last, radius, None, place.wrist)

    def _start(self, frame: Frame) -> Array | None:
        """Where a hand is (3,), metres, looking at the whole frame."""
        stride = max(1, round(frame.camera.width / START_COLUMNS))
        view = build_grid(frame, frame.camera.rect, (NEAREST, FARTHEST), stride, self._skin)
        return find_start(view.grid, view.surface, self._last)

    def _follow(self, frame: Frame, last: Array) -> Segmentation | None:
        """The hand within DEPTH_WINDOW of its last position (3,)."""
        z = float(last[2])
        region = frame.camera.rect_around(last, DEPTH_WINDOW)
        reach = (max(z - DEPTH_WINDOW, NEAREST), z + DEPTH_WINDOW)
        view = build_grid(frame, region, reach, max(1, round(NODE_SIZE * frame.camera.fx / z)), self._skin)
        palm = nearest_palm(view.grid, view.surface, last)
        if palm is None:
            return None
        self._last = palm.centre
        arm, centre, wrist = self._arm(view, palm)
        arm_mask = None if arm is None or wrist is None else arm_nodes(view.grid, palm, arm, wrist)
        labels = label_hand(view, palm, arm_mask, wrist)
        roi, skin, readings = hand_masks(view, labels, wrist)
        self._learn(view, roi, skin)
        return Segmentation(roi, skin, readings, centre, palm.radius, None if arm is None else arm.direction, wrist)

    def _arm(self, view: SurfaceGrid, palm: Palm) -> tuple[Arm | None, Array, WristPlane | None]:
        """The forearm, the palm's centre (3,) in the light of it, and the wrist."""
        guess = self._wrist.guess(palm)
        arm = find_arm(view.grid, palm, guess, self._arm_direction)
        if arm is None and self._skin is not None:
            arm = find_vanishing_arm(view.grid, palm, guess, blind_skin(view, self._skin), self._arm_direction)
        if arm is None:
            self._arm_direction = None
            return None, palm.centre, None
        self._arm_direction = arm.direction
        axis = hand_axis(view.grid, palm, arm, guess)
        seen = find_wrist(view.grid, palm, axis, guess)
        distance = self._wrist.update(palm, axis, seen)
        centre = palm.centre if seen is not None else palm_centre(view.grid, palm, axis, distance)
        plane = WristPlane(palm.centre + (distance + self._wrist_margin) * axis.direction, axis.direction)
        return arm, centre, plane

    def _forget_arm(self) -> None:
        self._arm_direction = None
        self._wrist.forget()

    def _learn(self, view: SurfaceGrid, roi: Rect, hand: Mask) -> None:
        """Adapt to the colours of the hand and of what is around it."""
        if self._skin is None or view.skin is None or view.frame.colour is None:
            return
        skin = view.skin[roi.relative_to(view.region).slices]
        self._skin.learn(view.frame.colour, roi, np.ascontiguousarray(skin), np.ascontiguousarray(hand))

    def _without_flying(self, frame: Frame, found: Segmentation) -> Segmentation:
        """The hand without readings that hang in the air, where depth alone tells what is hand."""
        if self._skin is not None and frame.colour is not None:
            return found
        hand = ~flying_pixels(frame.depth[found.region.slices], frame.camera.fx)
        return replace(found, readings=found.readings & hand, skin=found.skin & hand)
