"""The wrist: the hand ends where the forearm is narrowest. No wristband is needed."""

import math
from dataclasses import dataclass, replace

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.segmentation.arm_breadth import bin_middles, breadth_profile, cross_section_centre
from depthtrack.segmentation.forearm import Arm
from depthtrack.segmentation.grid import Grid
from depthtrack.segmentation.options import WristOptions
from depthtrack.segmentation.palm import Palm
from depthtrack.types import Array, Mask


@dataclass(frozen=True)
class WristPlane:
    """The plane that cuts the forearm off.

    point: (3,), metres, camera frame.
    normal: (3,) unit vector towards the arm, camera frame.
    """

    point: Array
    normal: Array


def find_wrist(grid: Grid, palm: Palm, arm: Arm, guess: float, options: WristOptions) -> float | None:
    """Return the distance of the wrist from the palm's centre along the arm, metres.

    It is where the hand narrows to the breadth of the forearm behind it. None if it hardly does, as if a flat hand is
    seen edge-on.

    guess: expected distance, metres.
    """
    profile = breadth_profile(grid, palm, arm, options.breadth)
    visible = int(np.searchsorted(bin_middles(options.breadth), visible_end(grid, palm, arm, options)))
    scores = (options.place_scale, options.breadth_weight, options.broadest_ratio)
    ratios = (options.narrow_ratio, options.broad_ratio, options.flare_ratio)
    window = (options.neighbours, options.least_behind)
    place = most_likely_wrist(profile, visible, guess, options.breadth.bin_width, window, ratios, scores)
    return None if math.isnan(place) else place


@compiled()
def most_likely_wrist(
    profile: Array,
    visible: int,
    guess: float,
    bin_width: float,
    window: tuple[int, int],
    ratios: tuple[float, float, float],
    scores: tuple[float, float, float],
) -> float:
    """Return the distance of the most likely wrist in a profile, metres, or NaN.

    profile: (bins,) breadth of the arm, metres.
    visible: number of first bins that are visible.
    guess: expected distance, metres.
    bin_width: metres.
    window: `neighbours` and `least_behind` of `WristOptions`.
    ratios: `narrow_ratio`, `broad_ratio` and `flare_ratio`.
    scores: `place_scale`, `breadth_weight` and `broadest_ratio`.
    """
    neighbours, least_behind = window
    narrow, broad, flare = ratios
    scale, weight, broadest = scores
    best, lowest = np.nan, np.inf
    for j in range(1, visible - least_behind):
        behind = profile[j : min(j + neighbours, visible)]
        wrist = narrow * behind.min()
        if wrist == 0 or not profile[j - 1] > wrist >= profile[j] or behind.max() > flare * behind.min():
            continue
        hand = profile[max(j - neighbours, 0) : j].max() / wrist
        if hand < broad:
            continue
        # The first bin's middle is half a bin away from the palm's centre.
        place = bin_width * (j + 0.5 - (wrist - profile[j]) / (profile[j - 1] - profile[j]))
        cost = ((place - guess) / scale) ** 2 - weight * min(hand, broadest)
        if cost < lowest:
            best, lowest = place, cost
    return best


def narrowest_distance(grid: Grid, palm: Palm, arm: Arm, options: WristOptions) -> float:
    """Return the distance of the arm's narrowest place from the palm's centre, metres.

    It is 0 without a visible arm, and small for a hand. An elbow can resemble a fist, but its narrowest place is a
    forearm away.
    """
    profile, middles = breadth_profile(grid, palm, arm, options.breadth), bin_middles(options.breadth)
    forearm = (options.forearm_from < middles) & (visible_end(grid, palm, arm, options) > middles)
    return float(middles[forearm][np.argmin(profile[forearm])]) if forearm.any() else 0.0


def visible_end(grid: Grid, palm: Palm, arm: Arm, options: WristOptions) -> float:
    """Return the distance from the palm's centre of the end of the reliable breadth, metres."""
    return float(((grid.points[arm.exits] - palm.centre) @ arm.direction).mean()) - options.fade_out


def palm_centre(
    grid: Grid, palm: Palm, arm: Arm, wrist_distance: float, wrist_to_palm: float, options: WristOptions
) -> Array:
    """Return the palm's centre (3,) by its distance from the wrist, metres, camera frame.

    It is on the visible surface: the middle of the hand's cross-section there. The widest place may be outside the
    palm.

    wrist_distance: of the wrist from `palm.centre`, metres.
    wrist_to_palm: of the wrist from the palm's centre in the hand model, metres.
    """
    distance = wrist_distance - wrist_to_palm
    middle = cross_section_centre(grid, palm, arm, distance, options.palm_section, options.breadth)
    return palm.centre if middle is None else middle


def hand_axis(
    grid: Grid, palm: Palm, arm: Arm, wrist_distance: float, wrist_to_palm: float, options: WristOptions
) -> Arm:
    """Return the arm with the direction from palm to wrist, if it is visible.

    A bent wrist is then cut across the palm, as in `HandShape`.

    wrist_distance, wrist_to_palm: as in `palm_centre`.
    """
    if palm.radius < options.frontal_palm_radius:
        return arm
    wrist = cross_section_centre(grid, palm, arm, wrist_distance, options.axis_section, options.breadth)
    if wrist is None:
        return arm
    if wrist_distance > options.shortest_axis:
        middle = palm.centre
    else:
        middle = palm_centre(grid, palm, arm, wrist_distance, wrist_to_palm, options)
    along = (wrist - middle) / np.linalg.norm(wrist - middle)
    return replace(arm, direction=along) if float(along @ arm.direction) > options.least_bend_cosine else arm


def arm_nodes(grid: Grid, palm: Palm, arm: Arm, plane: WristPlane) -> Mask:
    """Return the nodes (rows, columns) of the arm.

    They are beyond the plane and connected to the exits. Fingers that extend past the plane beside the arm are not
    connected to it there, and stay.
    """
    beyond = (grid.points @ plane.normal > float(plane.point @ plane.normal)).reshape(grid.depth.shape)
    mask = palm.paths.reached() & beyond
    labels, areas = grid.within(mask).surfaces()
    is_arm = np.zeros(len(areas) + 1, dtype=np.bool_)  # the last entry is that of label -1, no surface
    is_arm[labels.ravel()[arm.exits]] = True
    is_arm[-1] = False
    return is_arm[labels]
