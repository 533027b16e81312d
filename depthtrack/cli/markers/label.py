"""`depthtrack markers label`: find the markers of models in a capture."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import tyro

from depthtrack.cli.markers.capture_options import CaptureOptions
from depthtrack.cli.markers.folder_options import FolderOptions
from depthtrack.cli.markers.labelling_options import labelling_command
from depthtrack.cli.markers.model_options import ModelOptions
from depthtrack.cli.markers.start_options import StartOptions
from depthtrack.markers.labelling.options import LabellingOptions


@dataclass(frozen=True)
class LabelCommand:
    """Find the markers of models among the points of a capture, and the pose of each model.

    Labels in the capture are not used. Offline, the hands are measured, and the labelling is repeated. The folder has
    the labelled trajectories, confidence and residual of each sample, and a run folder of each hand for `evaluate`,
    `view`, `video` and `export`.
    """

    capture: tyro.conf.OmitArgPrefixes[CaptureOptions]
    folder: tyro.conf.OmitArgPrefixes[FolderOptions]
    model: tyro.conf.OmitArgPrefixes[ModelOptions] = field(default_factory=ModelOptions)
    start: tyro.conf.OmitArgPrefixes[StartOptions] = field(default_factory=StartOptions)
    calibrate: bool = True
    """Measure the sizes of the hands first, if enough frames show them; only the offline method does."""
    json: bool = False
    """Print figures as JSON instead of a table."""

    @property
    def labelling_options(self) -> LabellingOptions:
        """Options of the labelling."""
        raise NotImplementedError

    def run(self) -> None:
        from depthtrack.cli.markers.solution import solve_and_write

        measures = self.calibrate and self.labelling_options.offline.use
        solve_and_write(self, "label", "none", "if possible" if measures else "never")


def command(arguments: Sequence[str]) -> tuple[type[LabelCommand], Any]:
    """Return the command with the options of the labelling.

    Raises:
        InputError: if there is no such method.
    """
    return labelling_command(LabelCommand, arguments)
