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

    Labels in the capture are not used. The folder has the labelled trajectories, confidence and residual of each
    sample, and a run folder of each hand for `evaluate`, `view`, `video` and `export`.
    """

    capture: tyro.conf.OmitArgPrefixes[CaptureOptions]
    folder: tyro.conf.OmitArgPrefixes[FolderOptions]
    chosen: tyro.conf.OmitArgPrefixes[ModelOptions] = field(default_factory=ModelOptions)
    start: tyro.conf.OmitArgPrefixes[StartOptions] = field(default_factory=StartOptions)
    json: bool = False
    """Print figures as JSON instead of a table."""

    @property
    def labelling(self) -> LabellingOptions:
        """Options of the labelling."""
        raise NotImplementedError

    def run(self) -> None:
        from depthtrack.cli.markers.report_text import print_report
        from depthtrack.cli.progress import percent_bar
        from depthtrack.markers.automatic import find_start, label_from, sized_models
        from depthtrack.markers.initialisation.started import save_started
        from depthtrack.options import to_data

        models, options = self.chosen.load(), self.labelling
        self.folder.check(models)
        capture = self.start.part(self.capture.read())
        with percent_bar() as show:
            started = self.start.saved(models, len(capture))
            started = started or find_start(capture, models, self.start.initialisation, progress=show)
            show("labelling", 0.3)
            labelled = label_from(capture, sized_models(models, started), started, options)
        configuration = {"command": "label", "method": self.start.method, "labelling": to_data(options)}
        self.folder.write(labelled, self.capture.path, configuration)
        save_started(started, self.folder.out / "start.json")
        print_report(self.folder.out, labelled, self.json, start=started.confidence)


def command(arguments: Sequence[str]) -> tuple[type[LabelCommand], Any]:
    """Return the command with the options of the labelling.

    Raises:
        InputError: if there is no such method.
    """
    return labelling_command(LabelCommand, arguments)
