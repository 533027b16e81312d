"""The wrist over time: measured in some frames, predicted in others, from anatomy at first."""

import numpy as np

from depthtrack.segmentation.forearm import Arm
from depthtrack.segmentation.hand_size import AVERAGE_HAND, HandSize
from depthtrack.segmentation.options import WristFilterOptions
from depthtrack.segmentation.palm import Palm
from depthtrack.types import Array


class WristFilter:
    """Kalman filter of the distance from the palm to the wrist along the arm.

    The model assumes that the wrist stays where it is along the forearm's axis; its motion across the axis is measured.
    So its position is known while the hand is seen edge-on.

    hand: sizes of the hand; they may be replaced at any time.
    """

    def __init__(self, options: WristFilterOptions | None = None, hand: HandSize = AVERAGE_HAND) -> None:
        self._options, self.hand = options or WristFilterOptions(), hand
        self.reset()

    def reset(self) -> None:
        """Start again from anatomy."""
        self._point: Array | None = None
        self._variance = 0.0

    def set_wrist(self, point: Array) -> None:
        """Set the wrist on the visible surface, as if it had been measured there.

        point: (3,), metres, camera frame.
        """
        self._point, self._variance = point, self._options.measurement_sigma**2

    def guess(self, palm: Palm) -> float:
        """Return the expected distance of the wrist from the palm's centre, metres."""
        if self._point is None:
            return anatomical_guess(palm, self._options, self.hand)
        return float(np.linalg.norm(self._point - palm.centre))

    def update(self, palm: Palm, arm: Arm, measured: float | None) -> float:
        """Return the filtered distance of the wrist from the palm's centre along the arm, metres.

        measured: the distance in this frame, metres; anatomy replaces a missing measurement.
        """
        options = self._options
        if measured is None:
            value, sigma = anatomical_guess(palm, options, self.hand), options.guess_sigma
        else:
            value, sigma = measured, options.measurement_sigma
        if self._point is None:
            distance, self._variance = value, sigma**2
        else:
            distance = float((self._point - palm.centre) @ arm.direction)
            self._variance += options.step_sigma**2
            uncertainty = self._variance + sigma**2
            innovation, gate = value - distance, options.gate * uncertainty**0.5
            if palm.radius > options.edge_on_palm_radius or abs(innovation) < gate:
                gain = self._variance / uncertainty
                distance += gain * min(max(innovation, -gate), gate)
                self._variance *= 1 - gain
        self._point = palm.centre + distance * arm.direction
        return distance


def anatomical_guess(palm: Palm, options: WristFilterOptions, hand: HandSize) -> float:
    """Return the distance of the wrist from the palm's centre, metres, from the palm alone."""
    if palm.radius > options.edge_on_palm_radius:
        return hand.wrist_to_palm
    # The widest place may be anywhere on a hand that is seen edge-on; only its length is known.
    return min(max(options.hand_length - palm.tip_distance, options.nearest_guess), options.farthest_guess)
