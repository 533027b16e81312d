"""Where the palm is: the widest place of a limb's free end.

Hands are extremities: the places farthest, along the visible surface, from where it leaves the view. A palm is the
widest place near such a tip. It is told from heads, elbows and stumps of limbs by its size and by what leads away from
it: beyond a hand's reach from a palm at most one thing goes on, no wider than an arm, and towards the body.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from depthtrack.segmentation.grid import Grid, Paths
from depthtrack.types import Array, Index

# Lengths along the surface are measured from node to node, which makes them some 8 % longer than they are.
HAND_REACH = 0.17
"""Metres from the palm's centre to the tip of the middle finger of a large hand (95th percentile of men: hand length
211 mm; Greiner 1991), of which the palm's lower half is 50 mm. What is farther along the surface belongs to no hand."""

TIP_TO_PALM = 0.15
"""Metres from a fingertip, or a fist's knuckles, to the palm's centre, at most, in a hand of middle size."""

TIP_TO_WRIST = 0.20
"""Metres from a fingertip to the wrist, at most, likewise."""

EXIT_REACH = 0.24
"""Metres from the palm's centre up to which it is looked for what leads away from the hand."""

SMALLEST_AREA = 20e-4
"""Square metres a hand shows at least: a fist from the side is 40 cm^2, a child's half of that."""

PALM_RADII = (0.012, 0.063)
"""Metres: half the thickness of a child's palm seen from the side, and what is wider than any fist that closes around
nothing, seen by depth alone (a head: 75 mm)."""

LIMB_AREA = 10e-4
"""Square metres of surface between HAND_REACH and EXIT_REACH that make a limb; noise and held things show less."""

FINGER_AREA = 25e-4
"""Square metres of a finger, at most, that may be seen there."""

LARGEST_EXIT = 150e-4
"""Square metres that an arm shows between those distances, at most: 8 cm of one 12 cm wide, and half as much again."""

TIPS_PER_SURFACE = 4
SMALLEST_PROTRUSION = 0.05
"""Metres by which a tip stands out, at least."""


@dataclass(frozen=True)
class Palm:
    """A palm on a grid, lengths in metres.

    Flat index `node` of its centre, `centre` (3,) on the visible surface, camera frame, `radius` of the largest circle
    inscribed in it, `tip_distance` along the surface from the hand's farthest tip; `paths` from the centre along
    everything visible; `limbs`, flat indices (N,) of each thing that goes on beyond the hand's reach.
    """

    node: int
    centre: Array
    radius: float
    tip_distance: float
    paths: Paths
    limbs: tuple[Index, ...]


def find_palms(grid: Grid, surface: Grid) -> Iterator[Palm]:
    """Everything on `surface` (the nodes of `grid` that can be hand) that looks like a palm, found as asked for."""
    seen: set[int] = set()
    for tip in tips(surface):
        palm = palm_near(grid, surface, tip)
        if palm is not None and palm.node not in seen:
            seen.add(palm.node)
            yield palm


def tips(surface: Grid) -> Iterator[int]:
    """Flat indices of the free ends of every surface large enough to be a hand, farthest first.

    Geodesic extrema after Plagemann et al., "Real-time identification and localization of body parts from depth
    images", ICRA 2010: each is the node farthest from where the surface leaves the view (or, where it does not, from
    its widest place) and from the paths to the tips found before it.
    """
    labels, areas = surface.surfaces()
    edge = surface.edge
    for label in np.flatnonzero(areas >= SMALLEST_AREA):
        mine = labels == label
        roots = np.flatnonzero(mine & edge)
        if roots.size == 0:
            roots = np.array([np.argmax(surface.inscribed(mine))])
        paths = surface.paths(roots, limit=3.0)
        for _ in range(TIPS_PER_SURFACE):
            reached = np.where(paths.reached(), paths.distance, 0)
            tip = int(np.argmax(reached))
            if reached.flat[tip] < SMALLEST_PROTRUSION:
                break
            yield tip
            surface.extend(paths, paths.trace(tip), limit=3.0)


def palm_near(grid: Grid, surface: Grid, tip: int) -> Palm | None:
    """The widest place within a hand's length of a tip, if it looks like a palm."""
    from_tip = surface.paths([tip], TIP_TO_WRIST)
    radius = np.where(from_tip.distance < TIP_TO_PALM, surface.inscribed(from_tip.reached()), 0)
    widest = float(radius.max())
    if not PALM_RADII[0] < widest < PALM_RADII[1]:
        return None
    # A palm is longer than wide, so that the circle may slide along it: its middle place is the centre.
    places = np.flatnonzero(radius > 0.9 * widest)
    points = surface.points[places]
    middle = np.argmin(np.sum((points - points.mean(axis=0)) ** 2, axis=1))
    node = int(places[middle])
    paths = grid.paths([node], EXIT_REACH)
    near = paths.reached(HAND_REACH)
    if float(surface.areas[near].sum()) < SMALLEST_AREA:
        return None
    limbs = _limbs(grid, paths)
    if limbs is None:
        return None
    return Palm(node, points[middle], widest, float(from_tip.distance.flat[node]), paths, limbs)


def _limbs(grid: Grid, paths: Paths) -> tuple[Index, ...] | None:
    """What goes on beyond the reach of the hand from whose palm the paths come, towards the body if anything does, or
    None where that is nothing that a hand could be the end of. What a hand holds ends within EXIT_REACH."""
    near, edge = paths.reached(HAND_REACH), grid.edge
    labels, everything = grid.within(~near).surfaces()
    far = paths.reached() & ~near
    count = len(everything)
    goes_on, leads_home = np.zeros(count + 1, dtype=np.bool_), np.zeros(count + 1, dtype=np.bool_)
    goes_on[labels[far & ((paths.distance > EXIT_REACH - 0.01) | edge)]] = True
    leads_home[labels[edge]] = True  # the last one stands for -1, no surface
    limbs = np.flatnonzero(goes_on[:-1])
    home = leads_home[limbs]
    areas = np.bincount(labels[far], grid.areas[far], count)[limbs]
    # A limb that is cut off by the view on this side and ends freely on the other is a hand's the other way round.
    backwards = bool(np.any(near & edge) and np.any(areas[~home] > FINGER_AREA))
    # Beside an arm, what is no larger than a finger is one, seen from a palm that is not quite where it was thought.
    has_arm = home.any() or np.any(areas > FINGER_AREA)
    counts = (areas > (FINGER_AREA if has_arm else LIMB_AREA)) | (home & (areas > LIMB_AREA))
    if backwards or counts.sum() > 1 or areas.sum() > LARGEST_EXIT:
        return None
    chosen = limbs[home] if home.any() else limbs[counts] if counts.any() else limbs
    return tuple(np.flatnonzero((labels == label) & far) for label in chosen)


def finger_area(surface: Grid, palm: Palm) -> float:
    """Square metres of what is narrower than 26 mm, as fingers are: where a disc of 13 mm radius cannot reach."""
    breadth = 0.013
    hand = (surface.depth > 0) & palm.paths.reached(HAND_REACH)
    core = surface.inscribed(hand) > breadth
    cells = cv2.distanceTransform((~core).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5)
    reached = cells * (palm.centre[2] / surface.focal[0]) <= breadth
    return float(surface.areas[hand & ~reached].sum())
