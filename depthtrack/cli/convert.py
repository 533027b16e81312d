"""`depthtrack convert`: write a recording of any format as a folder or an MCAP file."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from depthtrack.cli.argument_checks import Output
from depthtrack.cli.progress import bar
from depthtrack.cli.recording_options import RecordingOptions
from depthtrack.cli.stated_default import number


@dataclass(frozen=True)
class OutputArgument:
    """Recording to write, after the one to read."""

    out: Annotated[Path, Output("recording", (".mcap",)), tyro.conf.Positional, tyro.conf.arg(metavar="OUT")]
    """Folder to write, or a file whose name ends in .mcap."""


@dataclass(frozen=True)
class Command:
    """Write a recording of any format as a sequence folder (TUM RGB-D layout) or an MCAP file.

    Lens distortion is removed, and colour is registered to the depth. The output is complete, or absent after an error
    or interrupt. Ground truth is kept in a folder only.
    """

    recording: tyro.conf.OmitArgPrefixes[RecordingOptions]
    output: tyro.conf.OmitArgPrefixes[OutputArgument]
    frames: Annotated[int | None, number(1, 10**7, metavar="N")] = None
    """Write only the first N frames."""
    colour: Literal["png", "jpg"] = "png"
    """Format of the colour images in a folder: png loses nothing, jpg is smaller."""
    overwrite: bool = False
    """Replace the recording in OUT."""

    def run(self) -> None:
        from depthtrack.recording.convert import MCAP, convert

        sequence, out = self.recording.open(), self.output.out
        total = min(len(sequence), self.frames or len(sequence))
        count = convert(
            sequence, out, self.frames, self.colour, self.overwrite, lambda frames: bar(frames, total=total)
        )
        skipped = len(sequence.damaged)
        left_out = f", {skipped} damaged ones left out" if skipped else ""
        print(f"wrote {out}: {count} frames{left_out}")
        truth = sequence.ground_truth
        if truth is not None and truth.benchmark is not None and out.suffix.lower() != MCAP:
            print(f"left out: joints of {truth.benchmark.benchmark.name} that are no keypoints of docs/joints.md")
