"""Notes about a recording, on standard error."""

import sys
from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from depthtrack.recording import Sequence


def print_notes(notes: Iterable[str]) -> None:
    """Print what the user must know about a recording."""
    for note in notes:
        print(f"note: {note}", file=sys.stderr, flush=True)


def notes_of(sequence: "Sequence") -> list[str]:
    """Return the notes of a recording, with those about the depth of a few frames."""
    from depthtrack.recording.depth_checks import depth_notes, sampled_histogram

    if not sequence.has_depth:
        return list(sequence.notes)
    return [*sequence.notes, *depth_notes(sampled_histogram(sequence), sequence.camera)]
