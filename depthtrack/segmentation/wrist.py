"""Where the hand ends: at the wrist, behind which the forearm is narrowest. No wristband is needed."""

import math
from dataclasses import dataclass, replace

import numba
import numpy as np

from depthtrack.segmentation.forearm import BIN, BIN_MIDDLES, Arm, breadth, section
from depthtrack.segmentation.grid import Grid
from depthtrack.segmentation.palm import Palm
from depthtrack.types import Array, Mask

WRIST_TO_PALM = 0.046
"""Metres from the wrist to the palm's centre: half the palm's length of `HandShape`."""

FOREARM = (0.03, 0.12)
"""Metres from the palm's centre between which an arm's narrowest place tells a hand from an elbow."""

NARROW = 1.09
"""The wrist is where the breadth comes within this factor of the narrowest place behind it. The narrowest place itself
is ill-defined: some forearms hardly taper."""

BROAD = 1.05
"""Factor on that by which the hand before it must be broader, for its end to be seen; BROADEST is as good as any."""

BROADEST = 1.5

FLARE = 1.4
"""Factor by which a forearm broadens within NEIGHBOURS bins, at most; what broadens faster is the hand again."""

NEIGHBOURS, FEWEST_BEHIND = 12, 4
"""Bins of `breadth` before and behind a place that are compared with it, 48 mm either way, and how many must be seen
behind."""

SPREAD, BREADTH_WEIGHT = 0.03, 4.0
"""Of several places, the one nearest to the guess (in units of so many metres, squared) and with the broadest hand
before it is the wrist."""

FLAT_PALM = 0.033
"""Metres; an inscribed circle of this radius is the palm seen from its front or back, whose middle lies on its axis."""

SHORTEST_AXIS = 0.01
"""Metres from the palm's centre to the wrist, at least, for the hand's direction to be taken from one to the other."""

LARGEST_BEND = 0.94
"""Cosine of the angle between hand and forearm that is believed, at most."""


@dataclass(frozen=True)
class WristPlane:
    """The plane that cuts the forearm off: through `point` (3,), metres, with the unit `normal` (3,) towards the
    arm, both in the camera frame."""

    point: Array
    normal: Array


def find_wrist(grid: Grid, palm: Palm, arm: Arm, guess: float) -> float | None:
    """Distance (m) of the wrist from the palm's centre along the arm, about `guess` metres away: where the hand comes
    down to the breadth of the forearm behind. None where it hardly does, as when a flat hand is seen from its side.
    """
    visible = int(np.searchsorted(BIN_MIDDLES, _visible_end(grid, palm, arm)))
    place = likeliest_wrist(breadth(grid, palm, arm), visible, guess)
    return None if math.isnan(place) else place


@numba.njit(cache=True)
def likeliest_wrist(seen: Array, visible: int, guess: float) -> float:
    """Distance (m) at which the breadth `seen` (bins,) most looks like a wrist, of its first `visible` bins; NaN for
    none. `guess` (m) is about where."""
    best, lowest = np.nan, np.inf
    for j in range(1, visible - FEWEST_BEHIND):
        behind = seen[j : min(j + NEIGHBOURS, visible)]
        wrist = NARROW * behind.min()
        if not seen[j - 1] > wrist >= seen[j] or behind.max() > FLARE * behind.min():
            continue
        hand = seen[max(j - NEIGHBOURS, 0) : j].max() / wrist
        if hand < BROAD:
            continue
        # The first bin's middle is half a bin away from the palm's centre.
        place = BIN * (j + 0.5 - (wrist - seen[j]) / (seen[j - 1] - seen[j]))
        cost = ((place - guess) / SPREAD) ** 2 - BREADTH_WEIGHT * min(hand, BROADEST)
        if cost < lowest:
            best, lowest = place, cost
    return best


def narrowest_place(grid: Grid, palm: Palm, arm: Arm) -> float:
    """Distance (m) from the palm's centre of the narrowest place of the arm.

    It is the wrist, right behind a hand; from an elbow, which may look like a fist, it is a forearm away.
    """
    seen = breadth(grid, palm, arm)
    forearm = (FOREARM[0] < BIN_MIDDLES) & (_visible_end(grid, palm, arm) > BIN_MIDDLES)
    return float(BIN_MIDDLES[forearm][np.argmin(seen[forearm])]) if forearm.any() else 0.0


def _visible_end(grid: Grid, palm: Palm, arm: Arm) -> float:
    """Distance (m) along the arm from the palm's centre beyond which its breadth fades out."""
    return float(((grid.points[arm.exits] - palm.centre) @ arm.direction).mean()) - 0.01


def palm_centre(grid: Grid, palm: Palm, arm: Arm, wrist_distance: float) -> Array:
    """The palm's centre (3,) on the visible surface, metres, by its distance from the wrist: the middle of the hand's
    cross-section there. It replaces the widest place where that need not be the palm."""
    middle = section(grid, palm, arm, wrist_distance - WRIST_TO_PALM, 0.015)
    return palm.centre if middle is None else middle


def hand_axis(grid: Grid, palm: Palm, arm: Arm, wrist_distance: float) -> Arm:
    """The arm with the direction from the palm's centre to the wrist, about `wrist_distance` (m) away, in place of the
    forearm's, where that is seen: a bent wrist is cut across the palm, as `HandShape` has it."""
    if palm.radius < FLAT_PALM:
        return arm
    wrist = section(grid, palm, arm, wrist_distance, 0.008)
    if wrist is None:
        return arm
    middle = palm.centre if wrist_distance > SHORTEST_AXIS else palm_centre(grid, palm, arm, wrist_distance)
    along = (wrist - middle) / np.linalg.norm(wrist - middle)
    return replace(arm, direction=along) if float(along @ arm.direction) > LARGEST_BEND else arm


def arm_nodes(grid: Grid, palm: Palm, arm: Arm, plane: WristPlane) -> Mask:
    """Nodes (rows, columns) of the arm: those beyond the plane that hang together with where the arm goes on.

    Fingers that reach past the plane beside the arm are not connected to it there, and stay.
    """
    beyond = (grid.points @ plane.normal > float(plane.point @ plane.normal)).reshape(grid.depth.shape)
    mask = palm.paths.reached() & beyond
    labels, areas = grid.within(mask).surfaces()
    goes_on = np.zeros(len(areas) + 1, dtype=np.bool_)  # the last one stands for -1, no surface
    goes_on[labels.ravel()[arm.exits]] = True
    goes_on[-1] = False
    return goes_on[labels]
