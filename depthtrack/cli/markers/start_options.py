"""Options that say which frames are labelled, and where the labelling starts."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from depthtrack.cli.markers.labelling_options import Method
from depthtrack.cli.stated_default import number, stated_default
from depthtrack.errors import InputError

if TYPE_CHECKING:
    from depthtrack.markers.capture import MarkerCapture
    from depthtrack.markers.initialisation.options import InitialisationOptions
    from depthtrack.markers.initialisation.started import StartedModels
    from depthtrack.markers.models.marker_model import MarkerModel


@dataclass(frozen=True)
class StartOptions:
    """Frames to label, and the start."""

    method: Method = "offline"
    """`offline` uses the whole capture, `online` only the frames before each, `paper` is Maycock et al. 2015."""
    frames: Annotated[tuple[int, int] | None, number(1, 10**9, metavar="FIRST LAST")] = None
    """Use only these frames of the capture, both included, counted from 1."""
    start: Annotated[Path | None, stated_default(metavar="START.json")] = None
    """The start.json of an earlier folder of the same frames, in place of a search for the models."""

    def part(self, capture: "MarkerCapture") -> "MarkerCapture":
        """Return the chosen frames of a capture.

        Raises:
            InputError: if it lacks them.
        """
        if self.frames is None:
            return capture
        first, last = self.frames
        if not 1 <= first <= last <= len(capture):
            raise InputError(f"--frames must be from 1 to {len(capture)} and not decrease, found {first} {last}")
        return capture.between(first - 1, last)

    @property
    def initialisation(self) -> "InitialisationOptions":
        """Options of the search for the models."""
        from depthtrack.markers.initialisation.options import InitialisationOptions

        return InitialisationOptions(method="paper" if self.method == "paper" else "search")

    def saved(self, models: "tuple[MarkerModel, ...]", frames: int) -> "StartedModels | None":
        """Return the saved start; None to search for the models.

        Raises:
            InputError: if it is of other models or frames.
        """
        from depthtrack.markers.initialisation.started import StartedModels

        if self.start is None:
            return None
        saved = StartedModels.from_json(self.start)
        names = [None if one is None else one.model.name for one in saved.models]
        wanted = [{model.name, model.mirrored().name} if model.open_side else {model.name} for model in models]
        if len(names) != len(wanted) or any(a is not None and a not in b for a, b in zip(names, wanted, strict=True)):
            expected = ", ".join(model.name for model in models)
            raise InputError(f"{self.start} must be of the models {expected}: name them in its order")
        if not 0 <= saved.frame < frames:
            raise InputError(f"{self.start} starts in frame {saved.frame + 1}, but the capture has {frames} frames")
        return saved
