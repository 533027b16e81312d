"""Options that say which frames are labelled, and where the labelling starts."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from depthtrack.cli.markers.labelling_options import Method
from depthtrack.cli.stated_default import stated_default
from depthtrack.errors import InputError

if TYPE_CHECKING:
    from depthtrack.markers.capture import MarkerCapture
    from depthtrack.markers.initialisation.started import StartedModels
    from depthtrack.markers.models.marker_model import MarkerModel


@dataclass(frozen=True)
class StartOptions:
    """Frames to label, and the start."""

    method: Method = "offline"
    """`offline` uses the whole capture, `online` only the frames before each, `paper` is Maycock et al. 2015."""
    frames: Annotated[tuple[int, int] | None, stated_default(metavar="FIRST LAST")] = None
    """Use only these frames of the capture, both included, counted from 1."""
    start: Annotated[Path | None, stated_default(metavar="START.json")] = None
    """The start.json of an earlier folder of the same frames, in place of a search for the models."""

    def part(self, capture: "MarkerCapture") -> "MarkerCapture":
        """Return the chosen frames of a capture. Raises InputError if it lacks them."""
        if self.frames is None:
            return capture
        first, last = self.frames
        if not 1 <= first <= last <= len(capture):
            raise InputError(f"--frames must be from 1 to {len(capture)} and not decrease, found {first} {last}")
        return capture.between(first - 1, last)

    def find(
        self, capture: "MarkerCapture", models: "tuple[MarkerModel, ...]", show: Callable[[str, float], None]
    ) -> "StartedModels":
        """Return the start: the saved one, or the best of a few frames.

        Raises:
            InputError: if no model is found, or the saved start is of other models or frames.
        """
        from depthtrack.markers.automatic import find_start
        from depthtrack.markers.initialisation.options import InitialisationOptions
        from depthtrack.markers.initialisation.started import StartedModels

        if self.start is None:
            options = InitialisationOptions(method="paper" if self.method == "paper" else "search")
            return find_start(capture, models, options, progress=show)
        saved = StartedModels.from_json(self.start)
        names = [None if one is None else one.model.name for one in saved.models]
        if len(names) != len(models) or any(
            name not in (None, model.name) for name, model in zip(names, models, strict=True)
        ):
            raise InputError(f"{self.start} must be of the models {', '.join(model.name for model in models)}")
        if not 0 <= saved.frame < len(capture):
            raise InputError(f"{self.start} starts in frame {saved.frame + 1}, which the capture lacks")
        return replace(saved)
