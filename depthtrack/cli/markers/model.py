"""`depthtrack markers model`: save a rigid body or a calibrated hand from a capture."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from depthtrack.cli.argument_checks import OUTPUT_FILE
from depthtrack.cli.markers.capture_options import CaptureOptions
from depthtrack.cli.markers.model_options import ModelOptions
from depthtrack.cli.stated_default import number, stated_default
from depthtrack.errors import InputError

if TYPE_CHECKING:
    from depthtrack.calibration.markers import CalibratedMarkers
    from depthtrack.markers.capture import MarkerCapture
    from depthtrack.markers.labelled_capture import LabelledCapture
    from depthtrack.markers.models.marker_model import MarkerModel


@dataclass(frozen=True)
class Command:
    """Save a rigid body or a calibrated hand for later captures.

    A body: `--body LABEL LABEL LABEL`. A hand: `-m LAYOUT`. Its sizes and marker offsets are measured on the labels of
    the capture if those of the layout are there. Else the capture is labelled first, and again with the result.
    """

    capture: tyro.conf.OmitArgPrefixes[CaptureOptions]
    out: Annotated[Path, OUTPUT_FILE, tyro.conf.arg(aliases=("-o",), metavar="MODEL.json")]
    """File to write."""
    body: Annotated[tuple[str, ...], stated_default(metavar="LABEL ...")] = ()
    """Markers of a rigid body; the first one is its origin."""
    frame: Annotated[int | None, number(1, 10**9, metavar="FRAME")] = None
    """Frame that the body is taken from, counted from 1 (default: the median of all frames)."""
    model: tyro.conf.OmitArgPrefixes[ModelOptions] = field(default_factory=ModelOptions)
    name: Annotated[str | None, stated_default()] = None
    """Name of the model (default: the name of the file for a body, the side for a hand)."""
    prefix: str = ""
    """Start of the labels in the capture that those of the layout lack, such as `L-`."""
    unlabelled: bool = False
    """Label the capture although it has the labels of the layout."""
    rounds: Annotated[int, number(0, 100)] = 1
    """Times that an unlabelled capture is labelled again with the calibrated hand before the last calibration."""
    json: bool = False
    """Print figures as JSON instead of text."""

    def run(self) -> None:
        from depthtrack.files import write_atomic
        from depthtrack.markers.folder.contents import check_names
        from depthtrack.strict_data import json_text

        if bool(self.body) == bool(self.model.models):
            raise InputError("give either the markers of a rigid body (--body) or the layout of a hand (-m)")
        if self.name is not None:
            check_names([self.name])
        capture = self.capture.read()
        model, figures = self._body(capture) if self.body else self._hand(capture)
        write_atomic(self.out, model.to_json())
        figures = {"model": str(self.out), "name": model.name, "markers": len(model.labels), **figures}
        print(json_text(figures, indent=2) if self.json else _text(figures))

    def _body(self, capture: "MarkerCapture") -> "tuple[MarkerModel, dict[str, Any]]":
        from depthtrack.markers.models.rigid_body import body_from_markers

        frame = None if self.frame is None else self.frame - 1
        model = body_from_markers(capture, self.body, self.name or self.out.stem, frame)
        return model, {"spread_mm": [round(1000 * float(s), 3) for s in model.spread]}

    def _hand(self, capture: "MarkerCapture") -> "tuple[MarkerModel, dict[str, Any]]":
        from depthtrack.calibration.marker_sides import with_measured_sides
        from depthtrack.calibration.markers import calibrate_markers

        models = self.model.load()
        if len(models) != 1 or models[0].is_rigid:
            raise InputError("a hand is calibrated on the layout of one hand: give one -m, such as 13 or left:19")
        if self.rounds < 0:
            raise InputError(f"the rounds must not be negative, found {self.rounds}")
        layout = models[0] if self.name is None else models[0].with_(name=self.name)
        labelled = None if self.unlabelled else self._labelled_by_name(capture, layout)
        if labelled is None:
            calibrated = calibrate_markers(self._labelled(capture, layout))
        else:
            calibrated = calibrate_markers(with_measured_sides(labelled))
        figures = {"labels": "found" if labelled is None else "of the capture"} | _figures(calibrated)
        return calibrated.model, figures

    def _labelled_by_name(self, capture: "MarkerCapture", layout: "MarkerModel") -> "LabelledCapture | None":
        from dataclasses import replace

        from depthtrack.markers.named_labels import labels_by_name

        labels = tuple(label.removeprefix(self.prefix) for label in capture.labels)
        if len(set(labels)) != len(labels):
            raise InputError(f"without the prefix '{self.prefix:.20}', labels of the capture are equal: choose another")
        return labels_by_name(replace(capture, labels=labels), [layout])

    def _labelled(self, capture: "MarkerCapture", layout: "MarkerModel") -> "LabelledCapture":
        """Return the capture labelled with the layout, whose places stay those of the layout."""
        from dataclasses import replace

        from depthtrack.calibration.markers import self_calibrate
        from depthtrack.cli.progress import percent_bar
        from depthtrack.markers.automatic import find_start, label_from, sized_models

        with percent_bar() as show:
            started = find_start(capture, (layout,), progress=show)

            def label(capture: "MarkerCapture", models: "tuple[MarkerModel, ...]") -> "LabelledCapture":
                show("labelling", 0.5)
                return label_from(capture, models, started)

            _, labelled = self_calibrate(capture, sized_models((layout,), started), label, self.rounds)
        found = labelled.models[0].hand
        assert found is not None
        worn = layout if layout.hand is not None and found.side == layout.hand.side else layout.mirrored()
        return replace(labelled, models=(worn,))


def _figures(calibrated: "CalibratedMarkers") -> dict[str, Any]:
    return {
        "frames": len(calibrated.frames),
        "residual_before_mm": round(1000 * calibrated.before, 3),
        "residual_mm": round(1000 * calibrated.after, 3),
        "sizes_mm": {
            name: {"size": round(1000 * size, 2), "deviation": round(1000 * deviation, 2)}
            for name, (size, deviation) in calibrated.sizes().items()
        },
        "spread_mm": [round(1000 * float(s), 3) for s in calibrated.model.spread],
    }


def _text(figures: dict[str, Any]) -> str:
    spread = max(figures["spread_mm"])
    lines = [f"{figures['model']}: {figures['name']} with {figures['markers']} markers, spread up to {spread:.2f} mm"]
    if "sizes_mm" in figures:
        lines += [
            f"{figures['frames']} frames, labels {figures['labels']}:"
            f" markers {figures['residual_mm']:.2f} mm from the hand, before {figures['residual_before_mm']:.2f} mm",
            *(
                f"{name.replace('_', ' '):<16} {size['size']:6.1f} mm, standard deviation {size['deviation']:.1f} mm"
                for name, size in figures["sizes_mm"].items()
            ),
        ]
    return "\n".join(lines)
