"""Options that choose the hand of a tracker."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from depthtrack.cli.stated_default import stated_default

if TYPE_CHECKING:
    from depthtrack.hand.shape import HandShape, Side
    from depthtrack.recording import Sequence
    from depthtrack.segmentation.options import SegmentationOptions
    from depthtrack.tracking.side_choice import SideChoice


@dataclass(frozen=True)
class HandOptions:
    """Sizes and surface of the tracker's hand."""

    hand: Annotated[str | None, stated_default(metavar="HAND.json|RIG.glb|truth")] = None
    """A hand file, a rigged mesh, or the recording's own sizes (default: the average adult's hand)."""
    side: Literal["auto", "right", "left"] = "auto"
    """Side of the average hand, or of the hand to read from a rig with both. `auto` tracks both sides in up to 160
    frames and takes the one that fits better."""

    @property
    def given_side(self) -> "Side | None":
        """The side, None for `auto`."""
        return None if self.side == "auto" else self.side

    def chosen(self, sequence: "Sequence", choice: "SideChoice | None" = None) -> "HandShape":
        """Return the hand for a recording.

        choice: what `choose_side` returned.

        Raises:
            InputError: if the hand is unreadable, or of another side than `side`.
        """
        from depthtrack.recording.hand_choice import chosen_hand

        return chosen_hand(sequence, self.hand, self.given_side if choice is None else choice.side)

    def choose_side(
        self,
        sequence: "Sequence",
        segmentation: "SegmentationOptions",
        threads: int | None = None,
        frames: int | None = None,
    ) -> "SideChoice | None":
        """Return the side of the hand in a recording; None if `hand` or `side` states it."""
        from depthtrack.cli.progress import percent_bar
        from depthtrack.machine import usable_cores
        from depthtrack.tracking.side_choice import choose_side

        if self.hand is not None or self.side != "auto":
            return None
        with percent_bar() as show:
            return choose_side(
                sequence,
                segmentation,
                threads or usable_cores(),
                frames,
                progress=lambda done, total: show("side of the hand", done / total),
            )

    def note(self, sequence: "Sequence", path: Path, choice: "SideChoice | None") -> str | None:
        """Return advice on the hand for the recording at `path`; None if one was given.

        choice: what `choose_side` returned.
        """
        if self.hand is not None:
            return None
        if choice is not None and not choice.sure:
            return f"side: uncertain; give --side, or measure this hand with  depthtrack calibrate {path}"
        own = sequence.hand
        if own is None:
            return f"sizes: the average adult's; measure this hand with  depthtrack calibrate {path}"
        chosen = self.chosen(sequence, choice)
        if own.side != chosen.side:
            return f"side: the recording shows a {own.side} hand: give --side or --hand truth"
        if own == chosen:
            return None
        return "sizes: the average adult's; the recording's own are used with  --hand truth"
