"""Where the hand ends: the forearm is found by its length and cut off at the narrowest place behind the palm.

No wristband and no colour is needed. What lies farther from the palm's centre than any hand reaches, measured along
the visible surface, is arm; the way back from there to the palm gives its direction in 3D, however foreshortened.
"""

from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from depthtrack.observation.grid import Depth, Grid, Mask
from depthtrack.observation.palm import Palm

Array = NDArray[np.float64]

WRIST_DISTANCE = 0.046
"""Metres from the palm's centre to the wrist where the image tells nothing: half the palm's length of `HandShape`."""

PALM_HALF_LENGTH = 0.05
"""Metres from the palm's centre within which the hand is broadest."""

WRIST_RANGE = (0.03, 0.12)
"""Metres from the palm's centre between which the forearm is narrowest."""

NARROW = 1.13
"""The wrist begins where the breadth is within this factor of the forearm's narrowest, just behind it. The narrowest
place itself is ill-defined: some forearms hardly taper."""

BROAD = 1.15
"""Factor on that by which a hand must be broader, for its end to be seen."""

GUESS_SIGMA, STEP_SIGMA, SEEN_SIGMA = 0.03, 0.008, 0.008
"""Metres, standard deviations: of the wrist's place without having seen it, of its motion along the arm from one frame
to the next, and of what is seen of it."""

FOREARM_START = 0.10
"""Metres from the palm's centre along the surface at which the forearm's direction is taken: just past the wrist."""

ARM_HALF_BREADTH = 0.07
"""Metres; nodes farther from the arm's axis than this do not count as its breadth."""

ARM_AREA = 3e-4
"""Square metres of an arm beyond the hand's reach that are seen at least; little, for it may point straight away."""

SMALLEST_BORDER = 0.03
"""Metres of the image's border that an arm leaving through it covers, at least; fingers cover less."""

_BIN = 0.004
_BINS = 50


@dataclass(frozen=True)
class WristPlane:
    """The plane that cuts the forearm off: through `point` (3,), metres, with the unit `normal` (3,) towards the
    arm, both in the camera frame."""

    point: Array
    normal: Array


@dataclass(frozen=True)
class Arm:
    """A visible forearm: unit `direction` (3,) from the palm along it, camera frame, and flat indices `exits` (N,) of
    the nodes where it goes on beyond the hand's reach."""

    direction: Array
    exits: NDArray[np.int64]


def find_arm(grid: Grid, palm: Palm, expected: Array | None = None) -> Arm | None:
    """The forearm of a palm, or None where no arm is seen. Of several things that lead away from the hand (an arm, a
    held stick) the one nearest to the `expected` direction (3,) is chosen, or else the largest."""
    areas = grid.areas()
    exits = [limb for limb in palm.limbs(grid) if float(areas.flat[limb].sum()) > ARM_AREA]
    exits += _at_border(grid, palm)
    arms = [Arm(_direction(grid, palm, nodes), nodes) for nodes in exits]
    if expected is not None:
        arms = [arm for arm in arms if float(arm.direction @ expected) > 0.5]
        return max(arms, key=lambda arm: float(arm.direction @ expected), default=None)
    return max(arms, key=lambda arm: len(arm.exits), default=None)


def find_wrist(grid: Grid, palm: Palm, arm: Arm) -> float | None:
    """Distance (m) of the wrist from the palm's centre along the arm: where the hand has come down to the forearm's
    breadth. None where the hand is hardly broader than the wrist, as when it is seen from its side.
    """
    distance = (np.arange(_BINS) + 0.5) * _BIN
    breadth = _breadth(grid, palm, arm)
    # Near the end of what is seen of the arm, breadth fades out.
    end = float(np.median((grid.points(arm.exits) - palm.centre) @ arm.direction)) - 0.01
    forearm = (distance > WRIST_RANGE[0]) & (distance < min(WRIST_RANGE[1], end))
    if not forearm.any():
        return None
    wrist = NARROW * breadth[forearm].min()
    widest = int(np.argmax(breadth[distance < PALM_HALF_LENGTH]))
    if breadth[widest] < BROAD * wrist:
        return None
    beyond = int(np.argmax(breadth[widest:] <= wrist)) + widest
    above, below = breadth[beyond - 1] - wrist, wrist - breadth[beyond]
    return float(distance[beyond - 1] + _BIN * above / (above + below))


class WristFilter:
    """Where the wrist is along the arm, over time: a Kalman filter on one number.

    The wrist is assumed to stay where it is along the forearm's axis (across it, the arm itself is seen to move), so
    that it is known while the hand shows its edge.
    """

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Start again from anatomy."""
        self._point: Array | None = None
        self._variance = GUESS_SIGMA**2

    def update(self, palm: Palm, arm: Arm, seen: float | None) -> float:
        """Distance (m) of the wrist from the palm's centre along the arm, given what is `seen` of it in this frame."""
        self._variance += STEP_SIGMA**2
        if self._point is None or self._variance > GUESS_SIGMA**2:
            distance, self._variance = WRIST_DISTANCE, GUESS_SIGMA**2
        else:
            distance = float((self._point - palm.centre) @ arm.direction)
        if seen is not None:
            gain = self._variance / (self._variance + SEEN_SIGMA**2)
            distance += gain * (seen - distance)
            self._variance *= 1 - gain
        self._point = palm.centre + distance * arm.direction
        return distance


def narrowest_place(grid: Grid, palm: Palm, arm: Arm) -> float:
    """Distance (m) from the palm's centre of the narrowest place of the arm.

    It is the wrist, right behind a hand; from an elbow, which may look like a fist, it is a forearm away.
    """
    distance, breadth = (np.arange(_BINS) + 0.5) * _BIN, _breadth(grid, palm, arm)
    arm_only = (distance > WRIST_RANGE[0]) & (breadth > 0.01)
    return float(distance[arm_only][np.argmin(breadth[arm_only])]) if arm_only.any() else WRIST_DISTANCE


def arm_nodes(grid: Grid, palm: Palm, arm: Arm, plane: WristPlane) -> Mask:
    """Nodes (rows, columns) of the arm: those beyond the plane that hang together with where the arm goes on.

    Fingers that reach past the plane beside the arm are not connected to it there, and stay.
    """
    seen = np.flatnonzero(np.isfinite(palm.paths.distance))
    beyond = np.zeros(grid.depth.shape, dtype=np.bool_)
    beyond.flat[seen[(grid.points(seen) - plane.point) @ plane.normal > 0]] = True
    labels, _ = grid.within(beyond).surfaces()
    through = np.unique(labels.ravel()[arm.exits])
    return np.isin(labels, through[through >= 0])


def _at_border(grid: Grid, palm: Palm) -> list[NDArray[np.int64]]:
    """Where an arm leaves the image before it has left the hand's reach."""
    distance = palm.paths.distance
    labels, _ = grid.within(grid.edge() & np.isfinite(distance) & (distance > WRIST_RANGE[0])).surfaces()
    parts = [np.flatnonzero(labels == label) for label in range(int(labels.max()) + 1)]
    cell = float(palm.centre[2]) / grid.camera.fx
    return [part for part in parts if len(part) * cell > SMALLEST_BORDER]


def _direction(grid: Grid, palm: Palm, exits: NDArray[np.int64]) -> Array:
    """Unit vector from the palm's centre to the forearm just past the wrist, on the way to `exits`."""
    start = np.empty(exits.size, dtype=np.int64)
    _walk_back(palm.paths.distance, palm.paths.parent, exits, FOREARM_START, start)
    towards = grid.points(start).mean(axis=0) - palm.centre
    return towards / np.linalg.norm(towards)


def _breadth(grid: Grid, palm: Palm, arm: Arm) -> Array:
    """Breadth (bins,) in metres of what is seen along the arm, in steps of 4 mm from the palm's centre."""
    nodes = np.flatnonzero(np.isfinite(palm.paths.distance))
    offset = grid.points(nodes) - palm.centre
    along = offset @ arm.direction
    aside = np.linalg.norm(offset - along[:, None] * arm.direction, axis=1)
    near = (aside < ARM_HALF_BREADTH) & (along > -4 * _BIN) & (along < (_BINS + 4) * _BIN)
    position, area = along[near] / _BIN - 0.5, grid.areas().ravel()[nodes[near]]
    # Each node's area is shared by the two bins it lies between, and smoothed over two thirds of a finger's breadth.
    left = np.floor(position).astype(np.int64)
    share = position - left
    total = np.bincount(left + 8, area * (1 - share), _BINS + 16) + np.bincount(left + 9, area * share, _BINS + 16)
    kernel = np.exp(-0.5 * (np.arange(-4, 5) / 1.5) ** 2)
    smooth = np.convolve(total, kernel / kernel.sum(), mode="same")[8 : 8 + _BINS]
    # An arm that points away from the camera covers less of the image by the sine of its angle to the line of sight.
    sight = palm.centre / np.linalg.norm(palm.centre)
    sine = np.sqrt(max(1 - float(arm.direction @ sight) ** 2, 0.1))
    return smooth / _BIN / sine


@numba.njit(cache=True)
def _walk_back(
    distance: Depth, parent: NDArray[np.int32], nodes: NDArray[np.int64], until: float, out: NDArray[np.int64]
) -> None:
    """For each node, the first on its path whose distance is at most `until`."""
    far, before = distance.ravel(), parent.ravel()
    for n in range(nodes.size):
        node = nodes[n]
        while far[node] > until:
            node = before[node]
        out[n] = node
