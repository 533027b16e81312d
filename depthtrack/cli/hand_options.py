"""Options that choose the hand of a tracker."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal

from depthtrack.cli.stated_default import stated_default
from depthtrack.errors import InputError

if TYPE_CHECKING:
    from depthtrack.calibration.calibrate import Calibration
    from depthtrack.hand.shape import HandShape, Side
    from depthtrack.recording import Sequence
    from depthtrack.segmentation.options import SegmentationOptions
    from depthtrack.tracking.side_choice import SideChoice


_CLEAR_MARGIN = 0.1
"""Share by which the energy of the stated side is higher if the other one is reported."""


@dataclass(frozen=True)
class HandOptions:
    """Sizes and surface of the tracker's hand."""

    hand: Annotated[str | None, stated_default(metavar="HAND.json|RIG.glb|truth|average")] = None
    """A hand file, a rigged mesh, the recording's own sizes, or the average adult's (default: `track` measures the hand
    first, other commands use the average)."""
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
        from depthtrack.recording.hand_choice import AVERAGE
        from depthtrack.tracking.side_choice import choose_side

        if self.hand not in (None, AVERAGE) or self.side != "auto":
            return None
        with percent_bar() as show:
            return choose_side(
                sequence,
                segmentation,
                threads or usable_cores(),
                frames,
                progress=lambda done, total: show("side of the hand", done / total),
            )

    def measured(
        self,
        sequence: "Sequence",
        segmentation: "SegmentationOptions",
        threads: int | None = None,
        frames: int | None = None,
    ) -> "HandShape | None":
        """Return the hand that is measured on a recording; None if `hand` states one.

        Its figures are printed.

        The average adult's hand is returned if the recording does not show a hand well enough.
        """
        from depthtrack.cli.measuring import calibrate_sequence
        from depthtrack.hand.shape import HandShape

        if self.hand is not None:
            return None
        try:
            found = calibrate_sequence(sequence, segmentation, self.given_side, threads=threads, frames=frames)
        except InputError as error:
            side = self.given_side or "right"
            print(f"the average adult's {side} hand is assumed: {error}", flush=True)
            return HandShape(side=side)
        print(measured_text(found), flush=True)
        return found.hand


def side_text(choice: "SideChoice") -> str:
    """Return a line on the side of an average hand."""
    from depthtrack.hand.shape import other_side

    if choice.frames == 0:
        return "a right hand is assumed: no hand was found in the frames that were tried"
    other = other_side(choice.side)
    uncertain = "" if choice.sure else "; the side is uncertain: give --side"
    margin = f"a {other} one fits {100 * choice.margin:.0f} % worse in {choice.frames} frames"
    return f"a {choice.side} hand: {margin}{uncertain}"


def quick_side(
    sequence: "Sequence", segmentation: "SegmentationOptions", threads: int = 1, frames: int | None = None
) -> "SideChoice":
    """Return the side that fits better in 24 frames, with the average hand of both sides."""
    from depthtrack.tracking.side_choice import SideOptions, choose_side
    from depthtrack.tracking.stretches import StretchOptions

    options = SideOptions(StretchOptions(stretches=4, stretch_frames=6))
    return choose_side(sequence, segmentation, threads, frames, options)


def other_side_text(choice: "SideChoice", stated: "Side") -> str | None:
    """Return a sentence if a hand of the other side than `stated` fits clearly better."""
    if choice.margin < _CLEAR_MARGIN or choice.side == stated:
        return None
    return (
        f"a {choice.side} hand fits {100 * choice.margin:.0f} % better than a {stated} one in {choice.frames} frames:"
        f" give --side {choice.side}, or --mirror if the images are mirrored"
    )


def measured_text(found: "Calibration") -> str:
    """Return one or two lines on a measured hand."""
    from depthtrack.hand.shape import other_side

    hand, other = found.hand, other_side(found.hand.side)
    margin = "" if found.side_margin is None else f", a {other} one fits {100 * found.side_margin:.0f} % worse"
    length = found.measured["hand_length"]
    sizes = (
        f"a {hand.side} hand{margin}; {length.mm:.0f} mm long, standard deviation {length.sigma_mm:.0f} mm; "
        f"{found.after_mm:.1f} mm from the skin of the points of {len(found.observations)} frames "
        f"(average hand {found.before_mm:.1f} mm)"
    )
    lines = [sizes, *size_notes(found)]
    return "\n".join(lines if found.side_sure else [*lines, "the side is uncertain: give --side"])


def size_notes(found: "Calibration") -> list[str]:
    """Return a line for each reason why measured sizes may be wrong."""
    notes = []
    if not found.is_of_usual_size:
        length = found.measured["hand_length"].mm
        notes.append(
            f"hardly any hand is {length:.0f} mm long: if the depth has another unit, give --depth-scale METRES"
        )
    if found.stiff_fingers:
        notes.append(
            f"fingers hardly bend ({', '.join(found.stiff_fingers)}), so their joints may be wrong by centimetres: "
            "measure a recording in which all fingers bend and stretch"
        )
    return notes
