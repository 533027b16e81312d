"""`depthtrack markers solve`: poses and sizes of hands from a capture."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import tyro

from depthtrack.cli.markers.capture_options import CaptureOptions
from depthtrack.cli.markers.folder_options import FolderOptions
from depthtrack.cli.markers.labelling_options import labelling_command
from depthtrack.cli.markers.model_options import ModelOptions
from depthtrack.cli.markers.start_options import StartOptions
from depthtrack.markers.labelling.options import LabellingOptions


@dataclass(frozen=True)
class SolveCommand:
    """Measure the hands of a capture, and find their pose in every frame.

    Sizes of each hand and offsets of its markers are calibrated on the capture itself. The models in the folder have
    them, for later captures of the same subject. Without labels of the models, the markers are labelled first.
    """

    capture: tyro.conf.OmitArgPrefixes[CaptureOptions]
    folder: tyro.conf.OmitArgPrefixes[FolderOptions]
    model: tyro.conf.OmitArgPrefixes[ModelOptions] = field(default_factory=ModelOptions)
    start: tyro.conf.OmitArgPrefixes[StartOptions] = field(default_factory=StartOptions)
    labels: Literal["auto", "file", "none"] = "auto"
    """Use the labels of the file, find them, or (auto) find them if the file lacks those of a model."""
    calibrate: bool = True
    """Calibrate sizes and offsets; otherwise the models are used as they are."""
    json: bool = False
    """Print figures as JSON instead of a table."""

    @property
    def labelling_options(self) -> LabellingOptions:
        """Options of the labelling."""
        raise NotImplementedError

    def run(self) -> None:
        from depthtrack.cli.markers.solution import solve_and_write

        solve_and_write(self, "solve", self.labels, "always" if self.calibrate else "never")


def command(arguments: Sequence[str]) -> tuple[type[SolveCommand], Any]:
    """Return the command with the options of the labelling.

    Raises:
        InputError: if there is no such method.
    """
    return labelling_command(SolveCommand, arguments)
