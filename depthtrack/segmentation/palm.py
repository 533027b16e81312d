"""Palm candidates: the widest places near the free ends of a surface.

Hands are extremities, so a palm is near a geodesic extremum: a node far along the surface from where it leaves the
image. Its size and the limbs beyond a hand's reach distinguish it from heads, elbows and stumps of limbs. At most one
limb may continue there, no wider than an arm, and towards the body.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from depthtrack.segmentation.grid import Grid, Paths
from depthtrack.segmentation.options import PalmOptions
from depthtrack.types import Array, Index


@dataclass(frozen=True)
class Palm:
    """A palm on a grid.

    node: flat index of its centre.
    centre: (3,) on the visible surface, metres, camera frame.
    radius: of the largest inscribed circle, metres.
    tip_distance: along the surface from the hand's farthest tip, metres.
    paths: shortest paths from the centre along the visible surface.
    limbs: flat indices (N,) of the nodes of each limb that continues beyond the hand's reach.
    """

    node: int
    centre: Array
    radius: float
    tip_distance: float
    paths: Paths
    limbs: tuple[Index, ...]


def find_palms(grid: Grid, candidates: Grid, options: PalmOptions) -> Iterator[Palm]:
    """Yield the palm candidates of a grid.

    candidates: the grid with only the nodes that may be hand.
    """
    found: set[int] = set()
    for tip in geodesic_extrema(candidates, options):
        palm = palm_near_tip(grid, candidates, tip, options)
        if palm is not None and palm.node not in found:
            found.add(palm.node)
            yield palm


def geodesic_extrema(candidates: Grid, options: PalmOptions) -> Iterator[int]:
    """Yield the flat indices of the free ends of surfaces as large as a hand.

    The farthest come first. An extremum is the node farthest from the roots of its surface and from the paths to
    earlier extrema. The roots are where the surface leaves the image, or else its widest place.

    Source: Plagemann et al., "Real-time identification and localization of body parts from depth images", ICRA 2010.
    """
    labels, areas = candidates.surfaces()
    edge = candidates.edge
    for label in np.flatnonzero(areas >= options.least_area):
        surface = labels == label
        roots = np.flatnonzero(surface & edge)
        if roots.size == 0:
            roots = np.array([np.argmax(candidates.inscribed(surface))])
        paths = candidates.paths(roots, options.path_limit)
        for _ in range(options.tips_per_surface):
            reached = np.where(paths.reached(), paths.distance, 0)
            tip = int(np.argmax(reached))
            if reached.flat[tip] < options.least_protrusion:
                break
            yield tip
            candidates.extend(paths, paths.trace(tip), options.path_limit)


def palm_near_tip(grid: Grid, candidates: Grid, tip: int, options: PalmOptions) -> Palm | None:
    """Return the widest place near a tip (flat index), or None if it is no palm."""
    from_tip = candidates.paths([tip], options.tip_to_wrist)
    radius = np.where(from_tip.distance < options.tip_to_palm, candidates.inscribed(from_tip.reached()), 0)
    widest = float(radius.max())
    if not options.least_radius < widest < options.largest_radius:
        return None
    # A palm is longer than wide, so that the circle may slide along it: its middle place is the centre.
    places = np.flatnonzero(radius > options.centre_share * widest)
    points = candidates.points[places]
    middle = np.argmin(np.sum((points - points.mean(axis=0)) ** 2, axis=1))
    node = int(places[middle])
    paths = grid.paths([node], options.exit_reach)
    near = paths.reached(options.hand_reach)
    if float(candidates.areas[near].sum()) < options.least_area:
        return None
    limbs = _limbs(grid, paths, options)
    if limbs is None:
        return None
    return Palm(node, points[middle], widest, float(from_tip.distance.flat[node]), paths, limbs)


def _limbs(grid: Grid, paths: Paths, options: PalmOptions) -> tuple[Index, ...] | None:
    """Return the limbs beyond the hand's reach, towards the body if any leads there.

    paths: from the palm's centre, up to `exit_reach`; an object in the hand ends within it.

    None means that no hand ends in such limbs.
    """
    near, edge = paths.reached(options.hand_reach), grid.edge
    labels, everything = grid.within(~near).surfaces()
    far = paths.reached() & ~near
    count = len(everything)
    continues, leaves_image = np.zeros(count + 1, dtype=np.bool_), np.zeros(count + 1, dtype=np.bool_)
    continues[labels[far & ((paths.distance > options.exit_reach - options.exit_tolerance) | edge)]] = True
    leaves_image[labels[edge]] = True  # the last entry is that of label -1, no surface
    limbs = np.flatnonzero(continues[:-1])
    to_body = leaves_image[limbs]
    areas = np.bincount(labels[far], grid.areas[far], count)[limbs]
    # A limb that leaves the image on this side and ends on the other belongs to a hand at its other end.
    backwards = bool(np.any(near & edge) and np.any(areas[~to_body] > options.finger_area))
    # Beside an arm, a limb of a finger's area is a finger; the palm's centre is a little off then.
    has_arm = to_body.any() or np.any(areas > options.finger_area)
    least = options.finger_area if has_arm else options.limb_area
    counts = (areas > least) | (to_body & (areas > options.limb_area))
    if backwards or counts.sum() > 1 or areas.sum() > options.exit_area:
        return None
    chosen = limbs[to_body] if to_body.any() else limbs[counts] if counts.any() else limbs
    return tuple(np.flatnonzero((labels == label) & far) for label in chosen)


def visible_finger_area(candidates: Grid, palm: Palm, options: PalmOptions) -> float:
    """Return the area, m^2, of the parts of a hand that an opening by a disc removes."""
    hand = (candidates.depth > 0) & palm.paths.reached(options.hand_reach)
    core = candidates.inscribed(hand) > options.finger_half_breadth
    cells = cv2.distanceTransform((~core).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5)
    opened = cells * (palm.centre[2] / candidates.focal[0]) <= options.finger_half_breadth
    return float(candidates.areas[hand & ~opened].sum())
