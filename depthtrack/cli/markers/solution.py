"""The work that `markers label` and `markers solve` share."""

from typing import TYPE_CHECKING, Any, Literal, Protocol

if TYPE_CHECKING:
    from depthtrack.calibration.marker_solution import LabelSource, MarkerSolution, Measuring
    from depthtrack.cli.markers.capture_options import CaptureOptions
    from depthtrack.cli.markers.folder_options import FolderOptions
    from depthtrack.cli.markers.model_options import ModelOptions
    from depthtrack.cli.markers.start_options import StartOptions
    from depthtrack.markers.labelling.options import LabellingOptions


class SolvingCommand(Protocol):
    """Options of a command that finds models in a capture."""

    @property
    def capture(self) -> "CaptureOptions": ...
    @property
    def folder(self) -> "FolderOptions": ...
    @property
    def model(self) -> "ModelOptions": ...
    @property
    def start(self) -> "StartOptions": ...
    @property
    def json(self) -> bool: ...
    @property
    def labelling_options(self) -> "LabellingOptions": ...


def solve_and_write(
    command: SolvingCommand, name: Literal["label", "solve"], labels: "LabelSource", calibrate: "Measuring"
) -> None:
    """Solve a capture, write the folder, and print the figures.

    name: of the command, for the configuration.

    Raises:
        InputError: if the capture or a model cannot be used, or the folder is in use.
    """
    from depthtrack.calibration.marker_solution import solve_capture
    from depthtrack.cli.markers.report_text import print_report
    from depthtrack.cli.progress import percent_bar
    from depthtrack.options import to_data

    models = command.model.load()
    command.folder.check(models)
    capture = command.start.part(command.capture.read())
    with percent_bar() as show:
        solution = solve_capture(
            capture,
            models,
            labels=labels,
            calibrate=calibrate,
            labelling=command.labelling_options,
            initialisation=command.start.initialisation,
            started=command.start.saved(models, len(capture)),
            progress=show,
        )
    configuration = {
        "command": name,
        "labels": labels,
        "synergies": command.model.synergies,
        "calibrate": calibrate,
        "method": command.start.method,
        "labelling": to_data(command.labelling_options),
    }
    measured: dict[str, Any] = {"sizes": _sizes(solution), "measured_sides": solution.measured_sides(models)}
    command.folder.write(solution.labelled, command.capture.path, configuration | measured, started=solution.started)
    if solution.started is not None:
        measured["start"] = solution.started.confidence
    print_report(command.folder.out, solution.labelled, command.json, **measured)


def _sizes(solution: "MarkerSolution") -> dict[str, Any]:
    """Return the sizes of each hand by name, mm, each with its standard deviation."""
    return {
        name: {size: {"mm": 1000 * length, "sd_mm": 1000 * sd} for size, (length, sd) in found.items()}
        for name, found in solution.sizes().items()
    }
