"""`depthtrack markers info`: summarise a marker capture."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import tyro

from depthtrack.cli.markers.capture_options import CaptureOptions

if TYPE_CHECKING:
    from depthtrack.markers.summary import CaptureSummary

_MOST_LINES = 12
"""Lines of a block; more follow in the JSON."""


@dataclass(frozen=True)
class Command:
    """Summarise a marker capture: frames, rate, markers, gaps, units, size of the scene."""

    capture: tyro.conf.OmitArgPrefixes[CaptureOptions]
    json: bool = False
    """Print JSON, in SI units, instead of text."""

    def run(self) -> None:
        from dataclasses import asdict

        from depthtrack.markers.formats.registry import find_format
        from depthtrack.markers.summary import summarise_capture
        from depthtrack.strict_data import json_text

        capture = self.capture.read()
        summary, path = summarise_capture(capture), self.capture.path
        if self.json:
            fields = {"capture": str(path), "format": find_format(path).description, **asdict(summary)}
            print(json_text(fields, indent=2))
        else:
            print(_text(f"{path.name}, {find_format(path).description}", summary))


def _text(name: str, summary: "CaptureSummary") -> str:
    first = "" if summary.first_frame == 1 else f", the first one is {summary.first_frame}"
    least, median, most = summary.points
    size = " x ".join(f"{high - low:.2f}" for low, high in zip(summary.lowest, summary.highest, strict=True))
    neighbours = "" if summary.neighbours is None else f", neighbouring points {1000 * summary.neighbours:.0f} mm apart"
    step = [] if summary.largest_step is None else [f"largest step {1000 * summary.largest_step:.1f} mm a frame"]
    residual = [] if summary.residual is None else [f"median residual {1000 * summary.residual:.2f} mm"]
    of_them = "labelled" if summary.labelled else "unlabelled"
    rows = [
        ("capture", [name]),
        ("frames", [f"{summary.frames} over {summary.duration:.2f} s, {summary.rate:.6g} Hz{first}"]),
        ("trajectories", [f"{summary.labelled} labelled, {summary.unlabelled} unlabelled"]),
        ("markers", _wrapped(summary.labels[: 10 * _MOST_LINES])),
        ("points", [f"{least} to {most} in a frame, median {median:g}"]),
        (
            "gaps",
            [
                f"{summary.gaps} between {summary.segments} measured segments, longest {summary.longest_gap:.3f} s,"
                f" {100 * summary.missing:.2f} % of the {of_them} samples",
                *_gap_lines(summary),
            ],
        ),
        ("scene", [f"{size} m{neighbours}", *step, *residual]),
        ("unit", [summary.unit]),
        ("notes", list(summary.notes) or ["none"]),
    ]
    return "\n".join(line for label, lines in rows for line in _block(label, lines))


def _gap_lines(summary: "CaptureSummary") -> list[str]:
    """Return a line for each labelled trajectory with gaps, or for all, the worst first."""
    counted = [gap for gap in summary.trajectories if gap.is_labelled or not summary.labelled]
    worst = sorted((gap for gap in counted if gap.gaps), key=lambda gap: -gap.missing)
    return [f"{gap.label}: {gap.gaps}, longest {gap.longest} frames, {100 * gap.missing:.2f} %" for gap in worst]


def _wrapped(labels: tuple[str, ...], width: int = 90) -> list[str]:
    """Return labels in lines of some width."""
    lines = [""]
    for label in labels:
        joined = f"{lines[-1]}, {label}" if lines[-1] else label
        if len(joined) > width:
            lines.append(label)
        else:
            lines[-1] = joined
    return lines


def _block(label: str, lines: list[str], width: int = 15) -> list[str]:
    """Return a label and its lines, equally indented; a long block is shortened."""
    shown = lines if len(lines) <= _MOST_LINES else [*lines[: _MOST_LINES - 1], f"... and {len(lines) - 11} more"]
    return [f"{label if i == 0 else '':<{width}}{line}" for i, line in enumerate(shown)]
