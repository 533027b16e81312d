"""The forearm behind a hand: what lies farther from the palm, along the visible surface, than any hand reaches.

The way back from there to the palm gives its direction in 3D, however foreshortened.
"""

from dataclasses import dataclass

import cv2
import numba
import numpy as np
from numpy.typing import NDArray

from depthtrack.observation.grid import Depth, Grid, Mask
from depthtrack.observation.palm import Nodes, Palm

Array = NDArray[np.float64]

ARM_AREA = 3e-4
"""Square metres of an arm beyond the hand's reach that are seen at least; little, for it may point straight away."""

SMALLEST_BORDER = 0.04
"""Metres of the image's border that an arm leaving through it covers, at least: a wrist is 39 mm thick and 57 broad
(`HandShape`), two fingers side by side are less."""

NEAREST_BORDER = 0.06
"""Metres from the palm's centre to where an arm leaves what is seen, at least; nearer, nothing of it would show."""

NEARER = 0.04
"""Metres by which an arm that vanishes too near to the sensor is nearer there than the palm."""

FOREARM_START = 0.05
"""Metres behind the wrist at which the forearm's direction is taken."""

SAME_ARM = 0.5
"""Cosine of the angle that an arm turns by between frames, at most."""

ARM_HALF_BREADTH = 0.07
"""Metres; nodes farther from the arm's axis than this do not count as its breadth."""

BIN = 0.004
BIN_MIDDLES: Array = BIN * (np.arange(50, dtype=np.float64) + 0.5)
"""Distances (m) from the palm's centre along the arm at which its breadth is measured."""


@dataclass(frozen=True)
class Arm:
    """A visible forearm: unit `direction` (3,) from the palm along it, camera frame, and flat indices `exits` (N,) of
    the nodes where it goes on beyond the hand's reach, or leaves what is seen."""

    direction: Array
    exits: Nodes


def find_arm(grid: Grid, palm: Palm, wrist_distance: float, expected: Array | None = None) -> Arm | None:
    """The forearm of a palm whose wrist is about `wrist_distance` metres away, or None where no arm is seen.

    Of several things that lead away from the hand (an arm, a held stick) the one nearest to the `expected` direction
    (3,) is chosen, or else the largest.
    """
    areas = grid.areas.ravel()
    exits = [limb for limb in palm.limbs if float(areas[limb].sum()) > ARM_AREA] or _leaving(grid, palm, grid.edge)
    return _chosen(grid, palm, exits, wrist_distance, expected)


def find_vanishing_arm(
    grid: Grid, palm: Palm, wrist_distance: float, blind: Mask, expected: Array | None = None
) -> Arm | None:
    """The forearm that comes from beside the camera and begins to be seen where the sensor's reach does.

    `blind` (rows, columns): nodes of skin without readings.
    """
    beside_blind = cv2.dilate(blind.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    exits = _leaving(grid, palm, beside_blind & (grid.depth < palm.centre[2] - NEARER))
    return _chosen(grid, palm, exits, wrist_distance, expected)


def breadth(grid: Grid, palm: Palm, arm: Arm) -> Array:
    """Breadth (50,) in metres of what is seen along the arm, at BIN_MIDDLES from the palm's centre."""
    nodes = np.flatnonzero(palm.paths.reached())
    offset = grid.points[nodes] - palm.centre
    along = offset @ arm.direction
    aside_squared = np.einsum("ij,ij->i", offset, offset) - along**2
    margin, count = 4, len(BIN_MIDDLES)
    near = (aside_squared < ARM_HALF_BREADTH**2) & (along > -margin * BIN) & (along < (count + margin) * BIN)
    position, area = along[near] / BIN - 0.5 + 2 * margin, grid.areas.ravel()[nodes[near]]
    # Each node's area is shared by the two bins that it lies between; then smoothed, as nodes are as wide as bins.
    left = np.floor(position).astype(np.int64)
    share, size = position - left, count + 4 * margin
    total = np.bincount(left, area * (1 - share), size) + np.bincount(left + 1, area * share, size)
    kernel = np.exp(-0.5 * (np.arange(-margin, margin + 1) / 1.5) ** 2)
    smooth = np.convolve(total, kernel / kernel.sum(), mode="same")[2 * margin : 2 * margin + count]
    # An arm that points away from the camera covers less of the image by the sine of its angle to the line of sight.
    sight = palm.centre / np.linalg.norm(palm.centre)
    sine = np.sqrt(max(1 - float(arm.direction @ sight) ** 2, 0.1))
    return np.asarray(smooth / BIN / sine)


def _leaving(grid: Grid, palm: Palm, border: Mask) -> list[Nodes]:
    """Where an arm leaves what is seen, through `border` (rows, columns), before it has left the hand's reach."""
    leaving = border & palm.paths.reached() & (palm.paths.distance > NEAREST_BORDER)
    labels, areas = grid.within(leaving).surfaces()
    parts = [np.flatnonzero(labels == label) for label in range(len(areas))]
    cell = float(palm.centre[2]) / grid.focal[0]
    return [part for part in parts if len(part) * cell > SMALLEST_BORDER]


def _chosen(grid: Grid, palm: Palm, exits: list[Nodes], wrist_distance: float, expected: Array | None) -> Arm | None:
    arms = [Arm(_direction(grid, palm, nodes, wrist_distance + FOREARM_START), nodes) for nodes in exits]
    if expected is not None:
        arms = [arm for arm in arms if float(arm.direction @ expected) > SAME_ARM]
        return max(arms, key=lambda arm: float(arm.direction @ expected), default=None)
    return max(arms, key=lambda arm: len(arm.exits), default=None)


def _direction(grid: Grid, palm: Palm, exits: Nodes, start: float) -> Array:
    """Unit vector from the palm's centre to where the forearm is `start` metres away, on the way to `exits`."""
    forearm = np.empty(exits.size, dtype=np.int64)
    walk_back(palm.paths.distance, palm.paths.parent, exits, start, forearm)
    towards = grid.points[forearm].mean(axis=0) - palm.centre
    return np.asarray(towards / np.linalg.norm(towards))


@numba.njit(cache=True)
def walk_back(distance: Depth, parent: NDArray[np.int32], nodes: Nodes, until: float, out: Nodes) -> None:
    """For each node, the first on its path whose distance is at most `until`, into `out`."""
    far, before = distance.ravel(), parent.ravel()
    for n in range(nodes.size):
        node = nodes[n]
        while far[node] > until:
            node = before[node]
        out[n] = node
