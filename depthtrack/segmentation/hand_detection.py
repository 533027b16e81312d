"""Which of the palms that are seen is the hand's: anywhere in the view at first, then near where it was."""

import numpy as np

from depthtrack.segmentation.forearm import find_arm
from depthtrack.segmentation.grid import Grid
from depthtrack.segmentation.palm import SMALLEST_AREA, Palm, find_palms, finger_area
from depthtrack.segmentation.wrist import narrowest_place
from depthtrack.segmentation.wrist_filter import anatomical_guess
from depthtrack.types import Array

SLICE, SLICE_STEP = 0.35, 0.2
"""Metres: a start looks at the nearest things first, in slices this thick: a hand and a forearm that points away."""

LARGEST_STEP = 0.12
"""Metres that a palm moves between frames, at most: 3.6 m/s at 30 Hz. What is farther is something else."""

SAME_PALM = 0.05
"""Metres within which of its last position a broad palm needs no comparison with others."""

# What speaks for a palm, in metres of distance that it makes up for. The weights are ours, chosen on 425 frames, 90 of
# them real, each taken alone: in 423 the hand cost least of all that looked like a palm.
DISTANCE_WEIGHT = 0.25
START_BREADTH_BONUS, BROAD_ENOUGH = 5.0, 0.028
FOLLOWED_BREADTH_COST, BROAD_PALM = 3.0, 0.042
FINGER_BONUS, FINGERS_AREA = 0.2, 40e-4
WRIST_COST, USUAL_WRIST, FARTHEST_WRIST = 1.5, 0.06, 0.21
NO_ARM_COST = 0.1


def find_start(grid: Grid, surface: Grid, lost: Array | None = None) -> Array | None:
    """Where a hand is (3,), metres, among the nodes of `surface` that may be hand; nearest things first.

    `lost` (3,) is where it was a moment ago, if it was seen.
    """
    depths = np.sort(surface.depth[surface.depth > 0])
    area = np.cumsum(depths**2) / (grid.focal[0] * grid.focal[1])
    if area.size == 0 or area[-1] < SMALLEST_AREA:
        return None
    # Up to here, everything visible together is too small to be a hand.
    start = float(depths[np.searchsorted(area, SMALLEST_AREA)])
    while start < depths[-1]:
        part = (grid.depth > start - SLICE_STEP) & (grid.depth < start + SLICE)
        near, hands = grid.within(part), surface.within(part)
        palms = list(find_palms(near, hands))
        if palms:
            return min(palms, key=lambda palm: start_cost(near, hands, palm, lost)).centre
        start += SLICE_STEP
    return None


def start_cost(grid: Grid, surface: Grid, palm: Palm, lost: Array | None) -> float:
    """Metres: how far a palm is, less what speaks for it: breadth, fingers, and a wrist right behind it."""
    fingers = FINGER_BONUS * min(finger_area(surface, palm) / FINGERS_AREA, 1)
    distance = DISTANCE_WEIGHT * float(palm.centre[2])
    if lost is not None:
        distance += float(np.linalg.norm(palm.centre - lost))
    breadth = START_BREADTH_BONUS * min(palm.radius, BROAD_ENOUGH)
    return distance + _wrist_cost(grid, palm) - breadth - fingers


def nearest_palm(grid: Grid, surface: Grid, last: Array) -> Palm | None:
    """The palm nearest to its last position (3,), if there is any."""
    nearest, lowest = None, np.inf
    for palm in find_palms(grid, surface):
        distance = float(np.linalg.norm(palm.centre - last))
        if distance > LARGEST_STEP:
            continue
        # Narrow places are fingers, or edges of things.
        cost = distance + FOLLOWED_BREADTH_COST * max(BROAD_PALM - palm.radius, 0)
        if cost < SAME_PALM:
            return palm
        cost += _wrist_cost(grid, palm)
        if cost < lowest:
            nearest, lowest = palm, cost
    return nearest


def _wrist_cost(grid: Grid, palm: Palm) -> float:
    """A hand has a wrist right behind it; an elbow or a stump of an arm has not."""
    arm = find_arm(grid, palm, anatomical_guess(palm))
    if arm is None:
        return NO_ARM_COST
    place = min(max(narrowest_place(grid, palm, arm), USUAL_WRIST), FARTHEST_WRIST)
    return WRIST_COST * (place - USUAL_WRIST)
