"""Options that choose the hand of a tracker."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from depthtrack.cli.stated_default import stated_default

if TYPE_CHECKING:
    from depthtrack.hand.shape import HandShape
    from depthtrack.recording import Sequence


@dataclass(frozen=True)
class HandOptions:
    """Sizes and surface of the tracker's hand."""

    hand: Annotated[str | None, stated_default(metavar="HAND.json|RIG.glb|truth")] = None
    """A hand file, a rigged mesh, or the recording's own sizes (default: the average adult's hand)."""
    side: Annotated[Literal["right", "left"] | None, stated_default(metavar="{right,left}")] = None
    """Side of the average hand (default: right), or of the hand to read from a rig with both."""

    def chosen(self, sequence: "Sequence") -> "HandShape":
        """Return the hand for a recording.

        Raises:
            InputError: if the hand is unreadable, or of another side than `side`.
        """
        from depthtrack.recording.hand_choice import chosen_hand

        return chosen_hand(sequence, self.hand, self.side)

    def note(self, sequence: "Sequence", path: Path) -> str | None:
        """Return advice on the hand for the recording at `path`; None if one was given."""
        if self.hand is not None:
            return None
        own = sequence.hand
        if own is None:
            return f"sizes: the average adult's; measure this hand with  depthtrack calibrate {path}"
        if own.side != (self.side or "right"):
            return f"side: the recording shows a {own.side} hand: give --side or --hand truth"
        if own == self.chosen(sequence):
            return None
        return "sizes: the average adult's; the recording's own are used with  --hand truth"
