"""The choice of a start among places of the hand.

A forearm can resemble a hand, and the segmentation without a prior may leave fingers out. So a start is judged in the
region of interest of its own pose, as the next frame is: what the hand leaves unexplained there counts.
"""

from typing import NamedTuple

from depthtrack.tracking.options import TrackingThresholds


class Start(NamedTuple):
    """A start in the region of interest of its pose.

    energy: in multiples of `Objective.clamp`.
    confidence: see `Confidence`.
    place: cost of the place of the hand, see `Observation.cost`, metres.
    """

    energy: float
    confidence: float
    place: float


def tries_places(thresholds: TrackingThresholds) -> bool:
    """Return whether any start tries other places."""
    return thresholds.start_confidence > 0 or thresholds.start_energy < float("inf")


def is_doubtful(start: Start, thresholds: TrackingThresholds) -> bool:
    """Return whether a start tries other places."""
    return start.confidence < thresholds.start_confidence or start.energy > thresholds.start_energy


def start_cost(start: Start, thresholds: TrackingThresholds) -> float:
    """Return the cost of a start, in multiples of `Objective.clamp`; the least one is chosen."""
    known = thresholds.start_confidence_weight * start.confidence
    return start.energy - known + thresholds.place_cost * start.place
