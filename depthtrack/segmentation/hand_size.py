"""Sizes of the hand that the segmentation uses, derived from a hand shape."""

from dataclasses import dataclass
from typing import Self

from depthtrack.hand.shape import HandShape


@dataclass(frozen=True)
class HandSize:
    """Sizes of a hand in metres.

    palm_half_thickness: distance from the palm's visible surface to its centre.
    wrist_to_palm: distance from the wrist to the palm's centre, half the palm's length.
    reach: largest distance from the palm's centre to a fingertip.
    """

    palm_half_thickness: float
    wrist_to_palm: float
    reach: float

    @classmethod
    def of(cls, shape: HandShape) -> Self:
        """Return the sizes of a hand."""
        return cls(
            shape.palm_thickness / 2 * shape.scale,
            shape.palm_length / 2 * shape.scale,
            shape.reach,
        )


AVERAGE_HAND = HandSize.of(HandShape())
"""Sizes of the average adult's hand, for frames without a prior."""
