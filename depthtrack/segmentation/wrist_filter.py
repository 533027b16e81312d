"""Where the wrist is over time: seen in some frames, remembered in others, guessed from anatomy at first."""

import numpy as np

from depthtrack.segmentation.forearm import Arm
from depthtrack.segmentation.palm import Palm
from depthtrack.segmentation.wrist import WRIST_TO_PALM
from depthtrack.types import Array

BROAD_PALM = 0.025
"""Metres; an inscribed circle of this radius is the palm's: a hand that shows its edge has none as large."""

HAND_LENGTH, GUESS_RANGE = 0.18, (0.04, 0.13)
"""Metres along the surface from the farthest fingertip to the wrist, the fingers a little bent; and between which the
wrist is guessed from the palm's centre, where the image tells no better."""

GUESS_SIGMA, STEP_SIGMA, SEEN_SIGMA = 0.035, 0.0022, 0.012
"""Metres, standard deviations: of such a guess, of the wrist's motion along the arm from one frame to the next, and of
what is seen of it. The last one is large, for what misleads in one frame misleads in the next ones too."""

SURPRISE = 2.0
"""Standard deviations beyond which what is seen counts no more than at that distance; where the hand shows its edge,
it is taken for something else."""


class WristFilter:
    """Where the wrist is along the arm: a Kalman filter on one number.

    The wrist is assumed to stay about where it is along the forearm's axis (across it, the arm itself is seen to move),
    so that it is known while the hand shows its edge.
    """

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Start again from anatomy."""
        self._point: Array | None = None
        self._variance = 0.0

    def expect(self, point: Array) -> None:
        """Take it to be at `point` (3,), metres, on the visible surface, as if it had just been seen there."""
        self._point, self._variance = point, SEEN_SIGMA**2

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
            surprise, most = measured - distance, SURPRISE * uncertainty**0.5
            if palm.radius > BROAD_PALM or abs(surprise) < most:
                gain = self._variance / uncertainty
                distance += gain * min(max(surprise, -most), most)
                self._variance *= 1 - gain
        self._point = palm.centre + distance * arm.direction
        return distance


def anatomical_guess(palm: Palm) -> float:
    """Distance (m) of the wrist from the palm's centre, from the palm alone."""
    if palm.radius > BROAD_PALM:
        return WRIST_TO_PALM
    # The widest place may be anywhere on a hand that shows its edge; its length is what is known.
    return min(max(HAND_LENGTH - palm.tip_distance, GUESS_RANGE[0]), GUESS_RANGE[1])
