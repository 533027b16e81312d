"""The forearm: the limb farther from the palm, along the surface, than a hand reaches.

The path from there to the palm gives its direction in 3D, even if it is foreshortened.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from depthtrack.compilation import compiled
from depthtrack.segmentation.grid import Grid
from depthtrack.segmentation.options import ForearmOptions
from depthtrack.segmentation.palm import Palm
from depthtrack.types import Array, Depth, Index, Mask


@dataclass(frozen=True)
class Arm:
    """A visible forearm.

    direction: (3,) unit vector from the palm along the forearm, camera frame.
    exits: (N,) flat indices of the nodes where it continues beyond the hand's reach, or leaves the image.
    """

    direction: Array
    exits: Index


def find_arm(
    grid: Grid, palm: Palm, wrist_distance: float, options: ForearmOptions, expected: Array | None = None
) -> Arm | None:
    """Return the forearm of a palm, or None without a visible arm.

    wrist_distance: approximate distance of the wrist from the palm's centre, metres.
    expected: (3,) expected unit direction; of several limbs (an arm, a held stick) the nearest to it is chosen, or
        else the largest.
    """
    areas = grid.areas.ravel()
    limbs = [limb for limb in palm.limbs if float(areas[limb].sum()) > options.least_area]
    exits = limbs or _border_crossings(grid, palm, grid.edge, options.nearest_border, options)
    return _best_arm(grid, palm, exits, wrist_distance, options, expected)


def find_vanishing_arm(
    grid: Grid, palm: Palm, wrist_distance: float, blind: Mask, options: ForearmOptions, expected: Array | None = None
) -> Arm | None:
    """Return the forearm that vanishes nearer than the sensor's range, or None.

    wrist_distance, expected: as in `find_arm`.
    blind: (rows, columns) nodes of skin without readings.
    """
    beside_blind = cv2.dilate(blind.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    nearer = grid.depth < palm.centre[2] - options.nearer
    exits = _border_crossings(grid, palm, beside_blind & nearer, options.nearest_gap, options)
    return _best_arm(grid, palm, exits, wrist_distance, options, expected)


def _border_crossings(grid: Grid, palm: Palm, border: Mask, nearest: float, options: ForearmOptions) -> list[Index]:
    """Return the flat indices (N,) of each place where the palm's surface crosses a border.

    It happens before the arm has left the hand's reach.

    border: (rows, columns).
    nearest: smallest distance from the palm's centre, metres.
    """
    crossing = border & palm.paths.reached() & (palm.paths.distance > nearest)
    labels, areas = grid.within(crossing).surfaces()
    parts = [np.flatnonzero(labels == label) for label in range(len(areas))]
    cell = float(palm.centre[2]) / grid.focal[0]
    return [part for part in parts if len(part) * cell > options.least_border]


def _best_arm(
    grid: Grid,
    palm: Palm,
    exits: list[Index],
    wrist_distance: float,
    options: ForearmOptions,
    expected: Array | None,
) -> Arm | None:
    start = wrist_distance + options.direction_start
    arms = [Arm(_direction(grid, palm, nodes, start), nodes) for nodes in exits]
    if expected is not None:
        arms = [arm for arm in arms if float(arm.direction @ expected) > options.least_cosine]
        return max(arms, key=lambda arm: float(arm.direction @ expected), default=None)
    return max(arms, key=lambda arm: len(arm.exits), default=None)


def _direction(grid: Grid, palm: Palm, exits: Index, start: float) -> Array:
    """Return the unit vector (3,) from the palm's centre to the forearm, camera frame.

    start: geodesic distance of the forearm on the paths to `exits`, metres.
    """
    forearm = np.empty(exits.size, dtype=np.int64)
    backtrack(palm.paths.distance, palm.paths.parent, exits, start, forearm)
    towards = grid.points[forearm].mean(axis=0) - palm.centre
    return np.asarray(towards / np.linalg.norm(towards))


@compiled()
def backtrack(distance: Depth, parent: NDArray[np.int32], nodes: Index, until: float, out: Index) -> None:
    """Find the first node on the path of each node whose distance is at most `until`.

    distance, parent: (rows, columns), as in `grid.Paths`.
    nodes: (N,) flat indices.
    until: metres.
    out: (N,) output, flat indices.
    """
    far, before = distance.ravel(), parent.ravel()
    for n in range(nodes.size):
        node = nodes[n]
        while far[node] > until:
            node = before[node]
        out[n] = node
