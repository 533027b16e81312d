"""Choice of the hand that a recording is tracked with."""

from pathlib import Path

from depthtrack.errors import InputError
from depthtrack.hand.hand_file import load_hand
from depthtrack.hand.shape import HandShape, Side
from depthtrack.recording.sequence import Sequence

TRUTH = "truth"
"""The name that selects the recording's own sizes."""
AVERAGE = "average"
"""The name that selects the average adult's hand."""


def chosen_hand(sequence: Sequence, hand: str | None = None, side: Side | None = None) -> HandShape:
    """Return the hand of a file, the recording's own, or the average adult's.

    hand: path of a hand file (hand.json) or a rigged mesh (.glb, .gltf); "truth" for the recording's own; "average" or
        None for the average adult's.
    side: the side of the average hand, right if None; otherwise the side that the hand must have.

    Raises:
        InputError: if the file holds no hand or the other side's, or if the recording has no sizes.
    """
    if hand in (None, AVERAGE):
        return HandShape(side=side or "right")
    if hand != TRUTH:
        return load_hand(Path(str(hand)), side)
    own = sequence.hand
    if own is None:
        raise InputError(
            f"the recording {sequence.name} must have a hand.json for --hand truth, found none: leave --hand out, or "
            "measure the hand with `depthtrack calibrate`"
        )
    if side not in (None, own.side):
        raise InputError(
            f"the recording {sequence.name} shows a {own.side} hand, but --side {side} was given: leave it out"
        )
    return own.with_(uncertainty=0.0)
