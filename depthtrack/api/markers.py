"""Label, solve, fill and evaluate optical marker captures."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from depthtrack.calibration.marker_solution import LabelSource, MarkerSolution, Measuring, Progress, solve_capture
from depthtrack.evaluation.marker_evaluation import MarkerEvaluation, evaluate_marker_folder
from depthtrack.hand.shape import HandShape
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.filled_capture import FilledCapture
from depthtrack.markers.filling.fill import fill_gaps
from depthtrack.markers.filling.options import FillOptions
from depthtrack.markers.folder.contents import Source
from depthtrack.markers.folder.reading import MarkerFolder, truth_beside
from depthtrack.markers.folder.writing import write_marker_folder
from depthtrack.markers.formats.registry import read_capture
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.markers.labelling.options import LabellingOptions
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.markers.models.model_choice import choose_models, with_synergies
from depthtrack.options import to_data

Models = Sequence[str | MarkerModel]
"""Models of a capture: each a model, the path of its file, or a layout such as "26" or "left:16"."""


def label_markers(
    capture: MarkerCapture | Path | str,
    models: Models,
    *,
    hand: HandShape | None = None,
    calibrate: bool = True,
    options: LabellingOptions | None = None,
    out: Path | str | None = None,
    progress: Progress | None = None,
) -> LabelledCapture:
    """Find the markers of models among the points of a capture, whose labels are not used.

    hand: sizes and side of hands that wear layouts. If absent, they start as the average adult's, and the markers
        decide the side of a layout without one.
    calibrate: measure the hands, and label again with the measured ones. Only the offline method does.
    options: of the labelling; those of the offline method if absent.
    out: folder to write.
    progress: called with the current step and the share of the work that is done.

    Returns:
        Labels, poses (T, 27) in the capture frame, metres and radians, and the probability of each label.

    Raises:
        InputError: a file or model cannot be used, no model is found, or the folder is in use.

    Example:
        labelled = depthtrack.label_markers("trial.c3d", ["26"], out="labelled")
        index_tip = labelled.positions(0)[:, labelled.models[0].labels.index("index_distal")]
    """
    given, source = _opened(capture)
    chosen, used = _models(models, hand), options or LabellingOptions()
    measuring: Measuring = "if possible" if calibrate and used.offline.use else "never"
    solution = solve_capture(given, chosen, labels="none", calibrate=measuring, labelling=used, progress=progress)
    _write(out, solution.labelled, source, {"command": "label", "calibrate": measuring, "labelling": to_data(used)})
    return solution.labelled


def solve_markers(
    capture: MarkerCapture | Path | str,
    models: Models,
    *,
    hand: HandShape | None = None,
    labels: LabelSource = "auto",
    calibrate: bool = True,
    options: LabellingOptions | None = None,
    out: Path | str | None = None,
    progress: Progress | None = None,
) -> MarkerSolution:
    """Measure the hands of a capture, and find their pose in every frame.

    The other arguments are those of `label_markers`.

    labels: "auto" uses the labels of the capture if it has those of the models; "file" requires them, "none" finds
        the labels in any case.
    calibrate: measure sizes and marker offsets on the capture.

    Raises:
        InputError: as `label_markers`, or too few frames show a hand.

    Example:
        solution = depthtrack.solve_markers("trial.c3d", ["26"], out="solved")
        depthtrack.export_run("solved/right", "angles.mot")
    """
    given, source = _opened(capture)
    chosen, used = _models(models, hand), options or LabellingOptions()
    measuring: Measuring = "always" if calibrate else "never"
    solution = solve_capture(given, chosen, labels=labels, calibrate=measuring, labelling=used, progress=progress)
    _write(out, solution.labelled, source, {"command": "solve", "calibrate": measuring, "labelling": to_data(used)})
    return solution


def fill_markers(
    labelled: LabelledCapture | MarkerFolder | Path | str,
    *,
    options: FillOptions | None = None,
    out: Path | str | None = None,
) -> FilledCapture:
    """Fill the gaps of a labelled capture.

    labelled: what `label_markers` or `solve_markers` returned or wrote.
    options: of the filling: method, longest gap, ends.
    out: folder to write.

    Returns:
        Positions without the gaps that could be filled, how each sample was filled, and its expected error, metres.

    Raises:
        InputError: the folder cannot be read, its source has changed since, or `out` is in use.

    Example:
        filled = depthtrack.fill_markers("solved", out="filled")
        print([gap for gap in filled.gaps() if not filled.is_filled(gap)])
    """
    source, used = None, options or FillOptions()
    if isinstance(labelled, Path | str):
        labelled = MarkerFolder.load(Path(labelled))
    if isinstance(labelled, MarkerFolder):
        labelled.check_source()
        source, labelled = labelled.contents.source, labelled.labelled
    filled = fill_gaps(labelled, used)
    _write(out, labelled, source, {"command": "fill", "filling": to_data(used)}, filled)
    return filled


def read_marker_folder(path: Path | str) -> MarkerFolder:
    """Read a folder that `label_markers`, `solve_markers`, `fill_markers` or a command wrote.

    Raises:
        InputError: it is none, or a file in it is malformed.

    Example:
        folder = depthtrack.read_marker_folder("solved")
        print([model.name for model in folder.labelled.models])
    """
    return MarkerFolder.load(Path(path))


def evaluate_markers(
    folder: Path | str, *, labels: Path | str | None = None, truth: Path | str | None = None
) -> MarkerEvaluation:
    """Compare the labels, positions and angles of a marker folder with the truth.

    labels: capture file with true labels of the same points.
    truth: marker folder with true labels and poses, or a synthetic capture. Without both, the folder must have been
        made from a synthetic capture.

    Returns:
        Accuracy, precision, recall, F1 and every wrong stretch; distances in millimetres; angles in degrees.

    Raises:
        InputError: a folder or file is missing or malformed, both truths are given, or none is found.

    Example:
        found = depthtrack.evaluate_markers("solved", labels="labelled.c3d")
        print(found.labels.accuracy, found.positions.to_json()["measured"])
    """
    given, known = (None if path is None else Path(path) for path in (labels, truth))
    return evaluate_marker_folder(Path(folder), given, known)


def _opened(capture: MarkerCapture | Path | str) -> tuple[MarkerCapture, Source | None]:
    if isinstance(capture, MarkerCapture):
        return capture, None
    return read_capture(capture), Source.of(Path(capture))


def _models(models: Models, hand: HandShape | None) -> tuple[MarkerModel, ...]:
    return with_synergies(choose_models([models] if isinstance(models, str) else models, hand), "auto")


def _write(
    out: Path | str | None,
    labelled: LabelledCapture,
    source: Source | None,
    configuration: dict[str, Any],
    filled: FilledCapture | None = None,
) -> None:
    if out is not None:
        truth = None if source is None else truth_beside(Path(source.path))
        write_marker_folder(Path(out), labelled, source, configuration, truth, filled=filled)
