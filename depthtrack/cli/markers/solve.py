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
    chosen: tyro.conf.OmitArgPrefixes[ModelOptions] = field(default_factory=ModelOptions)
    start: tyro.conf.OmitArgPrefixes[StartOptions] = field(default_factory=StartOptions)
    labels: Literal["auto", "file", "none"] = "auto"
    """Use the labels of the file, find them, or (auto) find them if the file lacks those of a model."""
    calibrate: bool = True
    """Calibrate sizes and offsets; otherwise the models are used as they are."""
    json: bool = False
    """Print figures as JSON instead of a table."""

    @property
    def labelling(self) -> LabellingOptions:
        """Options of the labelling."""
        raise NotImplementedError

    def run(self) -> None:
        from depthtrack.calibration.marker_solution import solve_capture
        from depthtrack.cli.markers.report_text import print_report
        from depthtrack.cli.progress import percent_bar
        from depthtrack.markers.initialisation.started import save_started
        from depthtrack.options import to_data

        models = self.chosen.load()
        self.folder.check(models)
        capture = self.start.part(self.capture.read())
        with percent_bar() as show:
            solution = solve_capture(
                capture,
                models,
                labels=self.labels,
                calibrate=self.calibrate,
                labelling=self.labelling,
                initialisation=self.start.initialisation,
                started=self.start.saved(models, len(capture)),
                progress=show,
            )
        sizes = {
            name: {size: {"mm": 1000 * length, "sd_mm": 1000 * sd} for size, (length, sd) in found.items()}
            for name, found in solution.sizes().items()
        }
        configuration = {
            "command": "solve",
            "labels": self.labels,
            "calibrate": self.calibrate,
            "method": self.start.method,
            "labelling": to_data(self.labelling),
            "sizes": sizes,
        }
        self.folder.write(solution.labelled, self.capture.path, configuration)
        if solution.started is not None:
            save_started(solution.started, self.folder.out / "start.json")
        print_report(self.folder.out, solution.labelled, self.json, sizes=sizes)


def command(arguments: Sequence[str]) -> tuple[type[SolveCommand], Any]:
    """Return the command with the options of the labelling.

    Raises:
        InputError: if there is no such method.
    """
    return labelling_command(SolveCommand, arguments)
