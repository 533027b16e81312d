"""Where the palm is: the widest place of a limb's free end.

Hands are extremities: the places farthest, along the visible surface, from where it leaves the view. A palm is the
widest place near such a tip. It is told from heads, elbows and stumps of limbs by its size and by what leads away from
it: at more than a hand's reach from a palm, at most one thing goes on, and it is no wider than an arm.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from depthtrack.observation.grid import Grid, Paths

Array = NDArray[np.float64]

HAND_REACH = 0.16
"""Metres from the palm's centre to the tip of the middle finger of a large hand (95th percentile of men: hand length
211 mm; Greiner 1991), of which the palm's lower half is 50 mm. What is farther along the surface belongs to no hand."""

TIP_TO_PALM = 0.14
"""Metres from a fingertip, or a fist's knuckles, to the palm's centre, at most, in a hand of middle size."""

TIP_TO_WRIST = 0.20
"""Metres from a fingertip to the wrist, at most: hand length."""

SMALLEST_AREA = 20e-4
"""Square metres a hand shows at least: a fist from the side is 40 cm^2, a child's half of that."""

PALM_RADII = (0.012, 0.058)
"""Metres: half the thickness of a child's palm seen from the side, and what is wider than any palm (a head: 75 mm)."""

LIMB_AREA = 10e-4
"""Square metres of surface between HAND_REACH and EXIT_REACH that make a limb; noise and held things show less."""

EXIT_REACH = 0.24
"""Metres from the palm's centre up to which it is looked for what leads away from the hand."""

LARGEST_EXIT = 150e-4
"""Square metres that an arm shows between those distances, at most: 8 cm of one 12 cm wide, and half as much again."""

TIPS_PER_SURFACE = 4
SMALLEST_PROTRUSION = 0.05
"""Metres by which a tip stands out, at least."""


@dataclass(frozen=True)
class Palm:
    """A palm on a grid: flat index `node` of its centre, `centre` (3,) on the visible surface, camera frame, and
    `radius` of the largest circle inscribed in it, both in metres; `paths` from the centre along everything visible."""

    node: int
    centre: Array
    radius: float
    paths: Paths

    def limbs(self, grid: Grid) -> list[NDArray[np.int64]]:
        """Flat indices (N,) of each thing that leads away from the hand: on beyond its reach, or out of the image.

        What a hand holds ends there.
        """
        distance = np.where(np.isfinite(self.paths.distance), self.paths.distance, 0)
        goes_on = (distance > EXIT_REACH - 0.01) | (grid.edge() & (distance > 0))
        labels, _ = grid.within(distance > HAND_REACH).surfaces()
        return [np.flatnonzero(labels == label) for label in np.unique(labels[goes_on & (labels >= 0)])]


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
    edge = surface.edge()
    for label in np.flatnonzero(areas >= SMALLEST_AREA):
        mine = labels == label
        roots = np.flatnonzero(mine & edge)
        if roots.size == 0:
            roots = np.array([np.argmax(surface.inscribed(mine))])
        paths = surface.paths(roots, limit=3.0)
        for _ in range(TIPS_PER_SURFACE):
            reached = np.where(np.isfinite(paths.distance), paths.distance, 0)
            tip = int(np.argmax(reached))
            if reached.flat[tip] < SMALLEST_PROTRUSION:
                break
            yield tip
            surface.extend(paths, paths.trace(tip), limit=3.0)


def palm_near(grid: Grid, surface: Grid, tip: int) -> Palm | None:
    """The widest place within a hand's length of a tip, if it looks like a palm."""
    from_tip = surface.paths([tip], TIP_TO_WRIST).distance
    radius = np.where(from_tip < TIP_TO_PALM, surface.inscribed(np.isfinite(from_tip)), 0)
    widest = float(radius.max())
    if not PALM_RADII[0] < widest < PALM_RADII[1]:
        return None
    # A palm is longer than wide, so that the circle may slide along it: its middle place is the centre.
    places = np.flatnonzero(radius > 0.9 * widest)
    points = surface.points(places)
    middle = np.argmin(np.sum((points - points.mean(axis=0)) ** 2, axis=1))
    node = int(places[middle])
    paths = grid.paths([node], EXIT_REACH)
    palm = Palm(node, points[middle], widest, paths)
    areas = [float(grid.areas().flat[limb].sum()) for limb in palm.limbs(grid)]
    looks_like_one = (
        float(surface.areas()[paths.distance <= HAND_REACH].sum()) > SMALLEST_AREA
        and sum(area > LIMB_AREA for area in areas) <= 1
        and sum(areas) < LARGEST_EXIT
    )
    return palm if looks_like_one else None


def finger_area(surface: Grid, palm: Palm) -> float:
    """Square metres of what is narrower than 26 mm, as fingers are: where a disc of 13 mm radius cannot reach."""
    breadth = 0.013
    hand = (surface.depth > 0) & (palm.paths.distance < HAND_REACH)
    core = surface.inscribed(hand) > breadth
    scale = palm.centre[2] / surface.camera.fx
    reached = cv2.distanceTransform((~core).astype(np.uint8), cv2.DIST_L2, 5) * scale <= breadth
    return float(surface.areas()[hand & ~reached].sum())
