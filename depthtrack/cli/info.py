"""`depthtrack info`: summarise a recording."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated

import tyro

from depthtrack.cli.progress import bar
from depthtrack.cli.recording_options import RecordingOptions
from depthtrack.cli.stated_default import number

if TYPE_CHECKING:
    from depthtrack.recording import Sequence
    from depthtrack.recording.summary import RecordingSummary
    from depthtrack.tracking.side_choice import SideChoice


@dataclass(frozen=True)
class Command:
    """Summarise a recording: frames, rate, camera, depth, ground truth, damage."""

    recording: tyro.conf.OmitArgPrefixes[RecordingOptions]
    sample: Annotated[int | None, number(1, 10**7, metavar="FRAMES")] = None
    """Number of evenly spaced frames to read (default: all)."""
    side: bool = False
    """Track hands of both sides in 24 frames, and name the side that fits better."""
    json: bool = False
    """Print JSON, in SI units and radians, instead of text."""

    def run(self) -> None:
        from dataclasses import asdict

        import numpy as np

        from depthtrack.recording.summary import summarise
        from depthtrack.strict_data import json_text

        sequence = self.recording.open(with_notes=False)
        count = min(len(sequence), self.sample or len(sequence))
        indices = np.linspace(0, len(sequence) - 1, count).round().astype(int).tolist()
        summary = summarise(
            sequence,
            indices,
            self.recording.on_damage,
            progress=lambda frames: bar(frames, total=count),
        )
        choice = self._side(sequence) if self.side and sequence.has_depth else None
        if self.json:
            fields = {name: value for name, value in vars(choice).items() if name != "views"} if choice else None
            print(json_text(asdict(summary) | {"side": fields}, indent=2))
        else:
            print(_text(summary, _side_lines(choice, sequence)))

    def _side(self, sequence: "Sequence") -> "SideChoice":
        from depthtrack.cli.hand_options import quick_side
        from depthtrack.cli.recording_notes import with_registered_colour
        from depthtrack.segmentation.options import SegmentationOptions

        depth_only = replace(self.recording, reading=replace(self.recording.reading, depth_only=True))
        registered = with_registered_colour(sequence, lambda: depth_only.open(with_notes=False))
        return quick_side(registered, SegmentationOptions())


def _side_lines(choice: "SideChoice | None", sequence: "Sequence") -> list[str]:
    """Return lines on the side of the hand."""
    from depthtrack.cli.hand_options import other_side_text, side_text

    if choice is None:
        return ["not compared (--side)"]
    if choice.frames == 0:
        return ["open: no hand was found in the frames that were tried"]
    better = None if sequence.hand is None else other_side_text(choice, sequence.hand.side)
    return [side_text(choice) if better is None else better]


def _text(summary: "RecordingSummary", side: list[str]) -> str:
    """Return aligned lines, with angles in degrees.

    side: lines on the side of the hand.
    """
    from math import degrees

    camera = summary.camera
    across, down = (degrees(angle) for angle in summary.field_of_view)
    rate = "" if summary.rate is None else f" over {summary.duration:.2f} s, {summary.rate:.4g} Hz"
    of_those_read = "" if summary.frames_read == summary.frames else f" (of {summary.frames_read} read)"
    rows = [
        ("recording", [summary.name]),
        ("frames", [f"{summary.frames}{rate}"]),
        ("gaps", [f"{gap.length:.3f} s after {gap.after:.3f} s" for gap in summary.gaps] or ["none"]),
        (
            "camera",
            [f"{camera.width}x{camera.height}, fx {camera.fx:g}, fy {camera.fy:g}, cx {camera.cx:g}, cy {camera.cy:g}"],
        ),
        ("field of view", [f"{across:.1f} x {down:.1f} degrees"]),
        ("depth", _depth_lines(summary)),
        ("no reading", [f"{100 * summary.missing:.1f} % of the pixels"]),
        ("colour", [f"{summary.colours} frames{of_those_read}" if summary.colours else "none"]),
        ("side", side),
        ("ground truth", _truth_lines(summary, of_those_read)),
        (
            "made as",
            [f"{_value_text(key)}: {_value_text(value)}" for key, value in summary.description.items()] or ["unknown"],
        ),
        ("damaged", _damage_lines(summary)),
        ("notes", summary.notes or ["none"]),
    ]
    return "\n".join(line for label, lines in rows for line in _block(label, lines))


def _depth_lines(summary: "RecordingSummary") -> list[str]:
    unit = f"in steps of {1000 * summary.camera.depth_scale:g} mm"
    if summary.depth_percentiles is None:
        return [f"no reading; {unit}"]
    nearest, low, median, high, farthest = summary.depth_percentiles.values()
    return [
        f"{nearest:.3f} to {farthest:.3f} m, {unit}",
        f"median {median:.3f} m, 98 % between {low:.3f} and {high:.3f} m",
    ]


def _truth_lines(summary: "RecordingSummary", of_those_read: str) -> list[str]:
    lines = [
        f"{name} in {count} frames{among}"
        for name, count, among in (
            ("poses", summary.poses, ""),
            ("joints", summary.joints, ""),
            ("hand masks", summary.masks, of_those_read),
            ("exact depth", summary.exact_depths, of_those_read),
        )
        if count
    ]
    return [*lines, *([f"hand sizes: {summary.hand}"] if summary.hand else [])] or ["none"]


def _damage_lines(summary: "RecordingSummary") -> list[str]:
    damaged = [*summary.damaged, *summary.damaged_colour]
    frames = [f"frame {frame.index} at {frame.timestamp:.3f} s: {frame.reason}" for frame in damaged]
    count, colours = len({frame.index for frame in summary.damaged}), len(summary.damaged_colour)
    of_colour = f", and the colour of {colours}" if colours else ""
    return [f"{count} of {summary.frames} frames{of_colour}", *frames] if frames else ["none"]


def _block(label: str, lines: list[str], width: int = 15, most: int = 12) -> list[str]:
    """Return a label and its lines, equally indented; a long block is shortened."""
    shown = lines if len(lines) <= most else [*lines[: most - 1], f"... and {len(lines) - most + 1} more"]
    return [f"{label if i == 0 else '':<{width}}{line}" for i, line in enumerate(shown)]


def _value_text(value: object) -> str:
    """Return a value of sequence.json as one line of at most 200 printable characters."""
    from depthtrack.strict_data import json_text

    text = value if isinstance(value, str) else json_text(value, ascii_only=False)
    text = "".join(c if c.isprintable() else " " for c in text)
    return text if len(text) <= 200 else text[:197] + "..."
