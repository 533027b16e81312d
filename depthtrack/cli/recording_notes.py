"""Notes about a recording, on standard error."""

import sys
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from depthtrack.recording import Sequence


def print_notes(notes: Iterable[str]) -> None:
    """Print what the user must know about a recording."""
    for note in notes:
        print(f"note: {note}", file=sys.stderr, flush=True)


def notes_of(sequence: "Sequence") -> list[str]:
    """Return the notes of a recording, with those about the depth of a few frames."""
    from depthtrack.recording.depth_checks import depth_notes
    from depthtrack.recording.depth_histogram import sampled_histogram

    if not sequence.has_depth:
        return list(sequence.notes)
    return [*sequence.notes, *depth_notes(sampled_histogram(sequence), sequence.camera)]


def with_registered_colour(sequence: "Sequence", open_depth: "Callable[[], Sequence]") -> "Sequence":
    """Return a recording, without colour that is not registered to the depth.

    open_depth: opens the recording without colour.
    """
    from depthtrack.recording.colour_registration import measure_shift

    shift = measure_shift(sequence) if sequence.has_colour and sequence.has_depth else None
    if shift is None or not shift.is_sure:
        return sequence
    depth_only = open_depth()
    depth_only.notes.append(f"{shift.note}: depth alone")
    return depth_only
