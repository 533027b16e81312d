"""Where the hand ends: at the wrist, where it has come down to the forearm's breadth. No wristband is needed."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthtrack.observation.arm import ARM_HALF_BREADTH, BIN, BIN_MIDDLES, Arm, breadth
from depthtrack.observation.grid import Grid, Mask
from depthtrack.observation.palm import Palm

Array = NDArray[np.float64]

WRIST_TO_PALM = 0.046
"""Metres from the wrist to the palm's centre: half the palm's length of `HandShape`."""

PALM_HALF_LENGTH = 0.05
"""Metres from the palm's centre within which the hand is broadest."""

FOREARM = (0.03, 0.12)
"""Metres from the palm's centre between which the forearm's narrowest place is looked for."""

NARROW = 1.13
"""The wrist is where the breadth comes within this factor of the forearm's narrowest, just behind it. The narrowest
place itself is ill-defined: some forearms hardly taper."""

BROAD_PALM = 0.025
"""Metres; an inscribed circle of this radius is the palm, seen from its front or back."""

BROAD = 1.15
"""Factor on that by which a hand must be broader, for its end to be seen."""

HAND_LENGTH, GUESS_RANGE = 0.18, (0.04, 0.13)
"""Metres along the surface from the farthest fingertip to the wrist, the fingers a little bent; and between which the
wrist is guessed from the palm's centre, where the image tells no better."""

GUESS_SIGMA, STEP_SIGMA, SEEN_SIGMA = 0.03, 0.008, 0.008
"""Metres, standard deviations: of such a guess, of the wrist's motion along the arm from one frame to the next, and of
what is seen of it."""

SURPRISE = 3.5
"""Standard deviations beyond which what is seen is taken for something else."""


@dataclass(frozen=True)
class WristPlane:
    """The plane that cuts the forearm off: through `point` (3,), metres, with the unit `normal` (3,) towards the
    arm, both in the camera frame."""

    point: Array
    normal: Array


def find_wrist(grid: Grid, palm: Palm, arm: Arm) -> float | None:
    """Distance (m) of the wrist from the palm's centre along the arm: where the hand has come down to the forearm's
    breadth. None where the hand is hardly broader than the wrist, as when it is seen from its side.
    """
    if palm.radius < BROAD_PALM:
        return None
    seen = breadth(grid, palm, arm)
    forearm = (FOREARM[0] < BIN_MIDDLES) & (min(FOREARM[1], _visible_end(grid, palm, arm)) > BIN_MIDDLES)
    if not forearm.any():
        return None
    wrist = NARROW * seen[forearm].min()
    widest = int(np.argmax(seen[BIN_MIDDLES < PALM_HALF_LENGTH]))
    if seen[widest] < BROAD * wrist:
        return None
    beyond = int(np.argmax(seen[widest:] <= wrist)) + widest
    above, below = seen[beyond - 1] - wrist, wrist - seen[beyond]
    return float(BIN_MIDDLES[beyond - 1] + BIN * above / (above + below))


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
    points = grid.points[palm.paths.reached().ravel()]
    along = (points - palm.centre) @ arm.direction - (wrist_distance - WRIST_TO_PALM)
    aside = np.linalg.norm(np.cross(points - palm.centre, arm.direction), axis=1)
    section = points[(np.abs(along) < 0.015) & (aside < ARM_HALF_BREADTH)]
    return np.asarray(section.mean(axis=0)) if len(section) else palm.centre


def arm_nodes(grid: Grid, palm: Palm, arm: Arm, plane: WristPlane) -> Mask:
    """Nodes (rows, columns) of the arm: those beyond the plane that hang together with where the arm goes on.

    Fingers that reach past the plane beside the arm are not connected to it there, and stay.
    """
    beyond = np.flatnonzero(palm.paths.reached())
    beyond = beyond[(grid.points[beyond] - plane.point) @ plane.normal > 0]
    mask = np.zeros(grid.depth.shape, dtype=np.bool_)
    mask.flat[beyond] = True
    labels, areas = grid.within(mask).surfaces()
    goes_on = np.zeros(len(areas) + 1, dtype=np.bool_)  # the last one stands for -1, no surface
    goes_on[labels.ravel()[arm.exits]] = True
    goes_on[-1] = False
    return goes_on[labels]


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
        self._variance = 0.0

    def guess(self, palm: Palm) -> float:
        """About how far (m) the wrist is from the palm's centre, before the arm is known."""
        return anatomical_guess(palm) if self._point is None else float(np.linalg.norm(self._point - palm.centre))

    def update(self, palm: Palm, arm: Arm, seen: float | None) -> float:
        """Distance (m) of the wrist from the palm's centre along the arm, given what is `seen` of it in this frame.

        Where nothing is seen of it, anatomy takes the place of sight.
        """
        measured, sigma = (anatomical_guess(palm), GUESS_SIGMA) if seen is None else (seen, SEEN_SIGMA)
        if self._point is None:
            distance, self._variance = measured, sigma**2
        else:
            distance = float((self._point - palm.centre) @ arm.direction)
            self._variance += STEP_SIGMA**2
            uncertainty = self._variance + sigma**2
            if (measured - distance) ** 2 < SURPRISE**2 * uncertainty:
                gain = self._variance / uncertainty
                distance += gain * (measured - distance)
                self._variance *= 1 - gain
        self._point = palm.centre + distance * arm.direction
        return distance


def anatomical_guess(palm: Palm) -> float:
    """Distance (m) of the wrist from the palm's centre, from the palm alone."""
    if palm.radius > BROAD_PALM:
        return WRIST_TO_PALM
    # The widest place may be anywhere on a hand that shows its edge; its length is what is known.
    return min(max(HAND_LENGTH - palm.tip_distance, GUESS_RANGE[0]), GUESS_RANGE[1])
