"""The forearm behind a hand: what lies farther from the palm, along the visible surface, than any hand reaches.

The way back from there to the palm gives its direction in 3D, however foreshortened.
"""

from dataclasses import dataclass

import cv2
import numba
import numpy as np
from numpy.typing import NDArray

from depthtrack.segmentation.grid import Grid
from depthtrack.segmentation.palm import Palm
from depthtrack.types import Array, Array32, Depth, Index, Mask

ARM_AREA = 3e-4
"""Square metres of an arm beyond the hand's reach that are seen at least; little, for it may point straight away."""

SMALLEST_BORDER = 0.04
"""Metres of the image's border that an arm leaving through it covers, at least: a wrist is 39 mm thick and 57 broad
(`HandShape`), two fingers side by side are less."""

NEAREST_BORDER = 0.06
"""Metres from the palm's centre to where an arm leaves what is seen, at least; nearer, nothing of it would show."""

NEARER = 0.02
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

MARGIN = 4
"""Bins beyond either end that are counted too, for breadth is smoothed: nodes are as wide as bins."""

_KERNEL = np.exp(-0.5 * (np.arange(-MARGIN, MARGIN + 1) / 1.5) ** 2)
_KERNEL /= _KERNEL.sum()


@dataclass(frozen=True)
class Arm:
    """A visible forearm: unit `direction` (3,) from the palm along it, camera frame, and flat indices `exits` (N,) of
    the nodes where it goes on beyond the hand's reach, or leaves what is seen."""

    direction: Array
    exits: Index


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
    total = np.zeros(len(BIN_MIDDLES) + 4 * MARGIN)
    area_along(grid.points, grid.areas.ravel(), palm.paths.distance.ravel(), palm.centre, arm.direction, total)
    smooth = np.convolve(total, _KERNEL, mode="same")[2 * MARGIN : 2 * MARGIN + len(BIN_MIDDLES)]
    # An arm that points away from the camera covers less of the image by the sine of its angle to the line of sight.
    sight = palm.centre / np.linalg.norm(palm.centre)
    sine = np.sqrt(max(1 - float(arm.direction @ sight) ** 2, 0.1))
    return np.asarray(smooth / BIN / sine)


@numba.njit(cache=True)
def area_along(points: Array, areas: Array32, reached: Array32, centre: Array, direction: Array, total: Array) -> None:
    """Area (m^2) of the nodes (N,) that are `reached` (finite), by their distance from `centre` (3,) along the unit
    `direction` (3,), added to `total` (bins + 4 MARGIN,); the first 2 MARGIN bins lie before the centre.

    Each node's area is shared by the two bins that it lies between.
    """
    last = total.size - 3 * MARGIN
    for n in range(reached.size):
        if not np.isfinite(reached[n]):
            continue
        x, y, z = points[n, 0] - centre[0], points[n, 1] - centre[1], points[n, 2] - centre[2]
        along = x * direction[0] + y * direction[1] + z * direction[2]
        near = -MARGIN * BIN < along < last * BIN
        if near and x * x + y * y + z * z - along * along < ARM_HALF_BREADTH**2:
            place = along / BIN - 0.5 + 2 * MARGIN
            left = int(np.floor(place))
            share = place - left
            total[left] += areas[n] * (1 - share)
            total[left + 1] += areas[n] * share


def section(grid: Grid, palm: Palm, arm: Arm, distance: float, half_width: float) -> Array | None:
    """Middle (3,) of what is seen of the arm `distance` from the palm's centre, give or take `half_width`; metres."""
    middle = np.empty(3)
    reached = palm.paths.distance.ravel()
    found = middle_of_section(grid.points, reached, palm.centre, arm.direction, distance, half_width, middle)
    return middle if found else None


@numba.njit(cache=True)
def middle_of_section(
    points: Array, reached: Array32, centre: Array, direction: Array, distance: float, half_width: float, middle: Array
) -> bool:
    """Mean (3,), into `middle`, of the points (N, 3) that are `reached` (finite) within ARM_HALF_BREADTH of a line
    from `centre` (3,) along the unit `direction` (3,), `distance` from the centre; whether there are any."""
    count = 0
    middle[:] = 0.0
    for n in range(reached.size):
        if not np.isfinite(reached[n]):
            continue
        x, y, z = points[n, 0] - centre[0], points[n, 1] - centre[1], points[n, 2] - centre[2]
        along = x * direction[0] + y * direction[1] + z * direction[2]
        aside_squared = x * x + y * y + z * z - along * along
        if abs(along - distance) < half_width and aside_squared < ARM_HALF_BREADTH**2:
            count += 1
            for axis in range(3):
                middle[axis] += points[n, axis]
    for axis in range(3):
        middle[axis] /= max(count, 1)
    return count > 0


def _leaving(grid: Grid, palm: Palm, border: Mask) -> list[Index]:
    """Where an arm leaves what is seen, through `border` (rows, columns), before it has left the hand's reach."""
    leaving = border & palm.paths.reached() & (palm.paths.distance > NEAREST_BORDER)
    labels, areas = grid.within(leaving).surfaces()
    parts = [np.flatnonzero(labels == label) for label in range(len(areas))]
    cell = float(palm.centre[2]) / grid.focal[0]
    return [part for part in parts if len(part) * cell > SMALLEST_BORDER]


def _chosen(grid: Grid, palm: Palm, exits: list[Index], wrist_distance: float, expected: Array | None) -> Arm | None:
    arms = [Arm(_direction(grid, palm, nodes, wrist_distance + FOREARM_START), nodes) for nodes in exits]
    if expected is not None:
        arms = [arm for arm in arms if float(arm.direction @ expected) > SAME_ARM]
        return max(arms, key=lambda arm: float(arm.direction @ expected), default=None)
    return max(arms, key=lambda arm: len(arm.exits), default=None)


def _direction(grid: Grid, palm: Palm, exits: Index, start: float) -> Array:
    """Unit vector from the palm's centre to where the forearm is `start` metres away, on the way to `exits`."""
    forearm = np.empty(exits.size, dtype=np.int64)
    walk_back(palm.paths.distance, palm.paths.parent, exits, start, forearm)
    towards = grid.points[forearm].mean(axis=0) - palm.centre
    return np.asarray(towards / np.linalg.norm(towards))


@numba.njit(cache=True)
def walk_back(distance: Depth, parent: NDArray[np.int32], nodes: Index, until: float, out: Index) -> None:
    """For each node, the first on its path whose distance is at most `until`, into `out`."""
    far, before = distance.ravel(), parent.ravel()
    for n in range(nodes.size):
        node = nodes[n]
        while far[node] > until:
            node = before[node]
        out[n] = node
