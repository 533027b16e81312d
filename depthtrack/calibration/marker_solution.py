"""Labels, poses and sizes of hands from a marker capture: label it, calibrate, label again."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from depthtrack.calibration.marker_sides import with_measured_sides
from depthtrack.calibration.markers import CalibratedMarkers, calibrate_markers
from depthtrack.errors import InputError
from depthtrack.markers.automatic import find_start, label_from, sized_models
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.initialisation.options import InitialisationOptions
from depthtrack.markers.initialisation.started import StartedModels
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.markers.labelled_fit import fit_poses
from depthtrack.markers.labelling.options import LabellingOptions
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.markers.named_labels import labels_by_name
from depthtrack.markers.sparse_poses import with_likely_postures

Measuring = Literal["always", "if possible", "never"]
"""Whether hands are measured: `if possible` leaves a hand that too few frames show as its start found it."""
LabelSource = Literal["auto", "file", "none"]
"""Labels that are used: those of the capture if it has them, only those, or none of them."""
Progress = Callable[[str, float], None]
"""Called with the step and the share of the work that is done, 0 to 1."""


@dataclass(frozen=True, eq=False)
class MarkerSolution:
    """A solved capture.

    labelled: labels, calibrated models and poses.
    calibrated: the calibration of each hand by its name; empty if the models were used as they are.
    started: start of the labelling; None if the labels of the capture were used.
    """

    labelled: LabelledCapture
    calibrated: Mapping[str, CalibratedMarkers]
    started: StartedModels | None = None

    def sizes(self) -> dict[str, dict[str, tuple[float, float]]]:
        """Return the lengths and widths of each hand by name.

        Each has its standard deviation, metres.
        """
        return {name: found.sizes() for name, found in self.calibrated.items()}

    def measured_sides(self, models: Sequence[MarkerModel]) -> list[str]:
        """Return the names of the hands whose side was open in the models that were given."""
        found = zip(models, self.labelled.models, strict=True)
        return [model.name for given, model in found if given.open_side]


def solve_capture(
    capture: MarkerCapture,
    models: Sequence[MarkerModel],
    *,
    labels: LabelSource = "auto",
    calibrate: Measuring = "always",
    labelling: LabellingOptions | None = None,
    initialisation: InitialisationOptions | None = None,
    started: StartedModels | None = None,
    progress: Progress | None = None,
) -> MarkerSolution:
    """Return labels, poses, sides and sizes of the models in a capture.

    labels: labels of the capture that are used.
    calibrate: whether the sizes of each hand and the offsets of its markers are measured.
    started: start of the labelling, in place of a search.

    Raises:
        InputError: if the capture lacks labels that must be used, no model is found, or too few frames show a hand.
    """
    show = progress or (lambda step, share: None)
    named = None if labels == "none" else labels_by_name(capture, models)
    if named is None and labels == "file":
        raise InputError(
            f"the capture lacks labels of {', '.join(model.name for model in models)[:80]}: label it first"
        )
    if named is not None:
        started, named = None, with_measured_sides(named)
    else:
        started = started or find_start(capture, models, initialisation, progress=show)
        show("labelling", 0.2)
        named = label_from(capture, sized_models(models, started), started, labelling)
    calibrated = {}
    for k, model in enumerate(named.models):
        if calibrate != "never" and not model.is_rigid:
            show(f"sizes of {model.name}", 0.5)
            try:
                calibrated[model.name] = calibrate_markers(named, k)
            except InputError:
                if calibrate == "always":
                    raise
    final = tuple(calibrated[model.name].model if model.name in calibrated else model for model in named.models)
    show("poses", 0.7)
    if started is None:
        named = fit_poses(replace(named, models=final), labelling)
        return MarkerSolution(with_likely_postures(named), calibrated)
    if calibrated:
        named = label_from(capture, final, started, labelling)
    return MarkerSolution(with_likely_postures(named), calibrated, started)
