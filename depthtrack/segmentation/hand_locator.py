"""Localisation of the hand without a prior: detect it, then follow it.

Source: Oikonomidis et al. 2011, Sec. 2.1.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from depthtrack.recording.sequence import Frame
from depthtrack.segmentation.forearm import Arm, find_arm, find_vanishing_arm
from depthtrack.segmentation.foreshortened_wrist import find_foreshortened_wrist, points_at_camera
from depthtrack.segmentation.grid import Grid
from depthtrack.segmentation.hand_detection import DetectedHand, HandDetector
from depthtrack.segmentation.hand_size import AVERAGE_HAND, HandSize
from depthtrack.segmentation.masks import HandMasks
from depthtrack.segmentation.options import SegmentationOptions
from depthtrack.segmentation.palm import Palm
from depthtrack.segmentation.pixel_labels import HAND, hand_masks, label_hand
from depthtrack.segmentation.skin_adaptation import AdaptiveSkin
from depthtrack.segmentation.surface_grid import SurfaceGrid, blind_skin, build_grid
from depthtrack.segmentation.wrist import WristPlane, arm_nodes, find_wrist, hand_axis, palm_centre, visible_end
from depthtrack.segmentation.wrist_filter import WristFilter
from depthtrack.types import Array


@dataclass(frozen=True)
class LocatedHand:
    """A hand in a frame.

    surface_centre: (3,) centre of the palm on the visible surface, metres, camera frame.
    palm_radius: of the circle inscribed in the palm, metres.
    arm_direction: (3,) unit vector from the palm along the forearm, camera frame; None without a visible arm.
    wrist: plane where the forearm is cut off, if any.
    """

    masks: HandMasks
    surface_centre: Array
    palm_radius: float
    arm_direction: Array | None
    wrist: WristPlane | None


class HandLocator:
    """Locates the hand in consecutive frames.

    It stores the last position, direction of the arm and wrist. `skin` stores the colours of the last frames.

    skin: skin colours, used if frames have colour; None for depth alone.
    hand: sizes of the hand: those of the last guided segmentation, else of the average hand.
    """

    def __init__(self, skin: AdaptiveSkin | None, options: SegmentationOptions) -> None:
        self._skin, self._options = skin, options
        self.hand = AVERAGE_HAND
        self._detector = HandDetector(options, self.hand)
        self._wrist = WristFilter(options.wrist_filter, self.hand)
        self._last: Array | None = None
        self._last_time = 0.0
        self._arm_direction: Array | None = None
        self._lost_since: float | None = None

    def reset(self) -> None:
        """Discard the last position and the colours of the last frames."""
        self._last, self._lost_since = None, None
        self._reset_arm()
        self._set_hand(AVERAGE_HAND)
        if self._skin is not None:
            self._skin.reset()

    def set_position(self, surface_centre: Array, wrist: Array, hand: HandSize, timestamp: float) -> None:
        """Replace the last position by that of a guided segmentation.

        surface_centre, wrist: (3,) centre of the palm and wrist on the visible surface, metres, camera frame.
        """
        self._last, self._last_time = surface_centre, timestamp
        # A guided segmentation does not measure the forearm.
        self._arm_direction = None
        self._wrist.set_wrist(wrist)
        self._set_hand(hand)

    def set_lost(self, lost: bool, timestamp: float) -> None:
        """State whether the tracker lost the hand in the frame of `timestamp` (s).

        The last position is discarded each time that the hand was lost for `search.lost_lifetime`: it may be that of
        something else.
        """
        lifetime = self._options.search.lost_lifetime
        if not lost or lifetime == 0:
            self._lost_since = None
        elif self._lost_since is None:
            self._lost_since = timestamp
        elif timestamp - self._lost_since >= lifetime:
            self._last, self._lost_since = None, timestamp

    def locate(self, frame: Frame) -> LocatedHand | None:
        """Return the hand in a frame, or None without any."""
        if not 0 <= frame.timestamp - self._last_time <= self._options.search.position_lifetime:
            self._last = None
        found = None if self._last is None else self._follow(frame, self._last)
        if found is None:
            found = self._locate_anywhere(frame)
        if found is None:
            return None
        self._last_time = frame.timestamp
        surface, located = found
        self._adapt_colours(surface, located.masks)
        return located

    def alternatives(self, frame: Frame) -> Iterator[tuple[LocatedHand, float]]:
        """Yield the hands that a start may try, and their costs beside the first one, metres.

        They are those at the palm candidates, and those whose palm and wrist are farther from the forearm. The state
        stays.
        """
        options = self._options.detection
        trial = HandLocator(self._skin, self._options)
        trial._set_hand(self.hand)
        detected = trial._detect(frame)[: options.alternatives]
        for number, hand in enumerate(detected):
            more = hand.cost - detected[0].cost
            if more > options.alternative_cost:
                return
            for shift in (0.0, *options.alternative_shifts) if number == 0 else (0.0,):
                trial._reset_arm()
                found = trial._follow(frame, hand.centre, shift)
                if found is not None:
                    yield found[1], more

    def _locate_anywhere(self, frame: Frame) -> tuple[SurfaceGrid, LocatedHand] | None:
        """Return the surface and the hand at the most likely palm, or another one of its arm."""
        self._reset_arm()
        detected, reach = self._detect(frame), self._options.palm.tip_to_wrist
        for hand in detected:
            if np.linalg.norm(hand.centre - detected[0].centre) < reach:
                found = self._follow(frame, hand.centre)
                if found is not None:
                    return found
                self._reset_arm()
        return None

    def _detect(self, frame: Frame) -> list[DetectedHand]:
        """Return the palms anywhere in the frame, the most likely first."""
        search, grid = self._options.search, self._options.grid
        stride = max(1, round(frame.camera.width / grid.start_columns))
        surface = build_grid(frame, frame.camera.rect, (search.nearest, search.farthest), stride, self._skin, grid)
        return self._detector.detect(surface.grid, surface.candidates, self._last)

    def _follow(self, frame: Frame, last: Array, shift: float = 0.0) -> tuple[SurfaceGrid, LocatedHand] | None:
        """Return the surface and the hand near its last position (3,), metres, camera frame.

        shift: distance by which palm and wrist are moved away from the forearm, metres; then an arm must be visible.
        """
        options, window, z = self._options, self._options.search.depth_window, float(last[2])
        region = frame.camera.rect_around(last, window)
        depth_range = (max(z - window, options.search.nearest), z + window)
        stride = max(1, round(options.grid.node_size * frame.camera.fx / z))
        surface = build_grid(frame, region, depth_range, stride, self._skin, options.grid)
        palm = self._detector.nearest_palm(surface.grid, surface.candidates, last)
        if palm is None:
            return None
        self._last = palm.centre
        arm, centre, wrist = self._find_arm(surface, palm)
        if shift != 0:
            if arm is None or wrist is None:
                return None
            step = shift * arm.direction
            centre, wrist = centre - step, replace(wrist, point=wrist.point - step)
        arm_mask = None if arm is None or wrist is None else arm_nodes(surface.grid, palm, arm, wrist)
        labels = label_hand(surface, palm, centre, arm_mask, wrist, options)
        if not (labels == HAND).any():
            return None
        masks = hand_masks(surface, labels, wrist, options)
        direction = None if arm is None else arm.direction
        return surface, LocatedHand(masks, centre, palm.radius, direction, wrist)

    def _find_arm(self, surface: SurfaceGrid, palm: Palm) -> tuple[Arm | None, Array, WristPlane | None]:
        """Return the forearm, the corrected centre of the palm (3,), and the wrist."""
        grid, options, to_palm = surface.grid, self._options, self._wrist.hand.wrist_to_palm
        guess, expected = self._wrist.guess(palm), self._arm_direction
        arm = find_arm(grid, palm, guess, options.forearm, expected)
        if arm is None and self._skin is not None:
            blind = blind_skin(surface, self._skin, options.grid)
            arm = find_vanishing_arm(grid, palm, guess, blind, options.forearm, expected)
        if arm is None:
            self._arm_direction = None
            return None, palm.centre, None
        self._arm_direction = arm.direction
        axis = hand_axis(grid, palm, arm, guess, to_palm, options.wrist)
        measured, centred = self._measured_wrist(grid, palm, axis, guess)
        distance = self._wrist.update(palm, axis, measured)
        centre = palm.centre
        if not centred:
            centre = palm_centre(grid, palm, axis, distance, to_palm, options.wrist)
        plane = WristPlane(palm.centre + (distance + options.wrist_margin) * axis.direction, axis.direction)
        return arm, centre, plane

    def _measured_wrist(self, grid: Grid, palm: Palm, axis: Arm, guess: float) -> tuple[float | None, bool]:
        """Return the wrist's distance along the arm, and whether the palm's centre is right.

        The distance is that from this centre, metres, or None if no wrist is found.
        """
        options = self._options
        if points_at_camera(palm, axis, options.foreshortened_wrist):
            end = visible_end(grid, palm, axis, options.wrist)
            found = find_foreshortened_wrist(grid, palm, axis, end, options.foreshortened_wrist)
            if found is not None:
                return found, False
        found = find_wrist(grid, palm, axis, guess, options.wrist)
        return found, found is not None

    def _set_hand(self, hand: HandSize) -> None:
        self.hand = self._detector.hand = self._wrist.hand = hand

    def _reset_arm(self) -> None:
        self._arm_direction = None
        self._wrist.reset()

    def _adapt_colours(self, surface: SurfaceGrid, masks: HandMasks) -> None:
        """Adapt the skin colours to those of the hand and of its surroundings."""
        if self._skin is None or surface.skin is None or surface.frame.colour is None:
            return
        skin = surface.skin[masks.region.relative_to(surface.region).slices]
        hand = np.ascontiguousarray(masks.silhouette)
        self._skin.adapt(surface.frame.colour, masks.region, np.ascontiguousarray(skin), hand)
