"""Options of the commands that read a capture and name its models."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from depthtrack.cli.stated_default import stated_default
from depthtrack.errors import InputError

if TYPE_CHECKING:
    from depthtrack.markers.capture import MarkerCapture
    from depthtrack.markers.models.marker_model import MarkerModel


@dataclass(frozen=True)
class CaptureOptions:
    """Capture to read."""

    path: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(name="capture", metavar="FILE")]
    """Capture: C3D, Qualisys TSV, Vicon CSV, Motive CSV, TRC or plain CSV, found by content."""
    rate: Annotated[float | None, stated_default(metavar="HZ")] = None
    """Frames a second, in place of the file's."""
    unit: Annotated[Literal["m", "cm", "mm"] | None, stated_default(metavar="m|cm|mm")] = None
    """Unit of length, in place of the file's (default: the file's, else by the size of the hand)."""
    frames: Annotated[tuple[int, int] | None, stated_default(metavar="FIRST LAST")] = None
    """Use only these frames, both included, numbered from 1 (default: all)."""

    def read(self) -> "MarkerCapture":
        """Return the capture.

        Raises:
            InputError: if it cannot be read, or lacks the frames.
            MissingExtraError: if it is C3D and ezc3d is not installed.
        """
        from depthtrack.markers.formats.registry import read_capture

        capture = read_capture(self.path, self.rate, self.unit)
        if self.frames is None:
            return capture
        first, last = self.frames
        if not 1 <= first <= last <= len(capture):
            raise InputError(f"--frames must be from 1 to {len(capture)} and increase, found {first} {last}")
        return capture.between(first - 1, last)


@dataclass(frozen=True)
class ModelOptions:
    """Models to find in a capture."""

    models: Annotated[tuple[str, ...], tyro.conf.arg(aliases=("-m",), metavar="MODEL ...")] = field(
        default_factory=tuple
    )
    """Each a layout such as 26 or left:16, a layout file, or the file of a model from `markers model` or `solve`."""
    hand: Annotated[Path | None, stated_default(metavar="HAND.json")] = None
    """Sizes of hands that wear layouts (default: the average adult's, which the capture corrects)."""

    def load(self) -> "tuple[MarkerModel, ...]":
        """Return the models.

        Raises:
            InputError: if there is none, or a file cannot be read.
        """
        from depthtrack.hand.shape import HandShape
        from depthtrack.markers.models.model_choice import choose_models

        return choose_models(self.models, None if self.hand is None else HandShape.from_json(self.hand))
