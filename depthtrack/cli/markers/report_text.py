"""The figures that the marker commands print."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from depthtrack.errors import printable
from depthtrack.strict_data import json_text

if TYPE_CHECKING:
    from depthtrack.markers.labelled_capture import LabelledCapture


def print_report(folder: Path, labelled: "LabelledCapture", as_json: bool, **entries: Any) -> None:
    """Print the figures of a labelled capture, as a table or as strict JSON.

    entries: of the JSON, after the figures.
    """
    from depthtrack.markers.label_report import label_report

    report = label_report(labelled)
    if as_json:
        print(json_text({"folder": str(folder), **report, **entries}, indent=2))
        return
    print(
        f"{folder}: {report['frames']} frames at {report['rate_hz']:g} Hz, "
        f"{report['labelled']} points labelled, {report['unlabelled']} without a label"
    )
    print(f"  {'':16}{'markers':>9}{'measured':>10}{'posed':>9}{'residual':>11}{'confidence':>12}")
    for name, model in report["models"].items():
        posed = model["frames_with_pose"] / max(report["frames"], 1)
        print(
            f"  {name:16}{model['markers']:>9}{_percent(model['measured_share']):>10}{_percent(posed):>9}"
            f"{_mm(model['residual_mm']):>11}{_share(model['confidence']):>12}"
        )
    for name in entries.get("measured_sides", ()):
        print(f"  {name}: the side was measured from the markers")
    for name, sizes in entries.get("sizes", {}).items():
        length = sizes["hand_length"]
        print(f"  {name}: {length['mm']:.1f} mm long, standard deviation {length['sd_mm']:.1f} mm")
    for note in labelled.capture.notes:
        print(f"  {printable(note)}")
    print(f"show it with  depthtrack view {folder}")


def _percent(share: float) -> str:
    return f"{100 * share:.2f} %"


def _mm(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f} mm"


def _share(value: float | None) -> str:
    return "-" if value is None else f"{value:.4f}"
