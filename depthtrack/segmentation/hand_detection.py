"""Detection of the hand among palm candidates, anywhere or near its last position."""

from typing import NamedTuple

import numpy as np

from depthtrack.segmentation.forearm import find_arm
from depthtrack.segmentation.grid import Grid
from depthtrack.segmentation.hand_size import HandSize
from depthtrack.segmentation.options import SegmentationOptions
from depthtrack.segmentation.palm import Palm, find_palms, visible_finger_area
from depthtrack.segmentation.wrist import narrowest_distance
from depthtrack.segmentation.wrist_filter import anatomical_guess
from depthtrack.types import Array


class DetectedHand(NamedTuple):
    """A palm candidate with its cost as a start.

    centre: (3,) on the visible surface, metres, camera frame.
    cost: metres of distance.
    """

    centre: Array
    cost: float


class HandDetector:
    """Chooses the palm of the hand by its cost, in metres of distance.

    hand: sizes of the hand; they may be replaced at any time.
    """

    def __init__(self, options: SegmentationOptions, hand: HandSize) -> None:
        self._options, self.hand = options, hand

    def detect(self, grid: Grid, candidates: Grid, lost: Array | None = None) -> list[DetectedHand]:
        """Return the palm candidates of the nearest slice of depth that has any, by increasing cost.

        candidates: the grid with only the nodes that may be hand.
        lost: (3,) last position of the hand, if it is recent, metres, camera frame.
        """
        options, least_area = self._options.detection, self._options.palm.least_area
        depths = np.sort(candidates.depth[candidates.depth > 0])
        area = np.cumsum(depths**2) / (grid.focal[0] * grid.focal[1])
        if area.size == 0 or area[-1] < least_area:
            return []
        # Up to here, all visible surfaces together are smaller than a hand.
        start = float(depths[np.searchsorted(area, least_area)])
        while start < depths[-1]:
            part = (grid.depth > start - options.slice_step) & (grid.depth < start + options.slice_depth)
            near, hands = grid.within(part), candidates.within(part)
            palms = list(find_palms(near, hands, self._options.palm))
            if palms:
                found = [DetectedHand(palm.centre, self.start_cost(near, hands, palm, lost)) for palm in palms]
                return sorted(found, key=lambda hand: hand.cost)
            start += options.slice_step
        return []

    def start_cost(self, grid: Grid, candidates: Grid, palm: Palm, lost: Array | None) -> float:
        """Return the distance of a palm, plus its wrist's cost, less bonuses, metres."""
        options = self._options.detection
        finger_area = visible_finger_area(candidates, palm, self._options.palm)
        fingers = options.finger_bonus * min(finger_area / options.all_fingers_area, 1)
        distance = options.distance_weight * float(palm.centre[2])
        if lost is not None:
            distance += float(np.linalg.norm(palm.centre - lost))
        breadth = options.start_radius_bonus * min(palm.radius, options.rewarded_palm_radius)
        return distance + self._wrist_cost(grid, palm) - breadth - fingers

    def nearest_palm(self, grid: Grid, candidates: Grid, last: Array) -> Palm | None:
        """Return the palm of lowest cost near its last position, or None.

        It may be smaller than one anywhere: the detection samples other pixels.

        candidates: the grid with only the nodes that may be hand.
        last: (3,), metres, camera frame.
        """
        options = self._options.detection
        nearest, lowest = None, np.inf
        for palm in find_palms(grid, candidates, self._options.palm.at_known_place):
            distance = float(np.linalg.norm(palm.centre - last))
            if distance > options.largest_step:
                continue
            # Narrow places are fingers, or edges of objects.
            cost = distance + options.narrow_cost * max(options.full_palm_radius - palm.radius, 0)
            if cost < options.accepted_cost:
                return palm
            cost += self._wrist_cost(grid, palm)
            if cost < lowest:
                nearest, lowest = palm, cost
        return nearest

    def _wrist_cost(self, grid: Grid, palm: Palm) -> float:
        """Return the cost of a narrowest place that is too far away for a wrist, metres."""
        options = self._options
        guess = anatomical_guess(palm, options.wrist_filter, self.hand)
        arm = find_arm(grid, palm, guess, options.forearm)
        if arm is None:
            return options.detection.no_arm_cost
        usual, farthest = options.detection.usual_wrist, options.detection.farthest_wrist
        place = min(max(narrowest_distance(grid, palm, arm, options.wrist), usual), farthest)
        return options.detection.wrist_cost * (place - usual)
