"""Options of `depthtrack view` for recordings and runs."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from depthtrack.cli.argument_checks import OUTPUT_FILE, PICTURE, VIDEO
from depthtrack.cli.recording_options import RecordingOptions
from depthtrack.cli.stated_default import number, stated_default

MOST_FRAMES = 200
"""Largest number of frames on a contact sheet or strip."""


@dataclass(frozen=True)
class ViewOptions:
    """Content to show and files to write."""

    recording: tyro.conf.OmitArgPrefixes[RecordingOptions]
    sheet: Annotated[Path | None, PICTURE, stated_default(metavar="FILE.png|.jpg")] = None
    """Contact sheet to write, with evenly spaced frames of the recording."""
    strip: Annotated[Path | None, PICTURE, stated_default(metavar="FILE.png|.jpg")] = None
    """Strip of close-ups to write: one column per frame, with colour, depth, hand and skeleton below each other."""
    video: Annotated[Path | None, VIDEO, stated_default(metavar="FILE.mp4")] = None
    """Video of the whole recording to write."""
    rrd: Annotated[Path | None, OUTPUT_FILE, stated_default(metavar="FILE.rrd")] = None
    """File of the interactive viewer to write (rerun FILE.rrd opens it)."""
    web: bool = False
    """Serve the interactive viewer to browsers, on all network interfaces, until interrupted."""
    frames: Annotated[tuple[int, ...], number(0, 10**7, metavar="INDEX...")] = ()
    """Indices of the frames on sheet and strip (default: evenly spaced frames)."""
    count: Annotated[int | None, number(1, MOST_FRAMES, metavar="COUNT")] = None
    """Number of evenly spaced frames (default: 12 on a sheet, 7 on a strip)."""
    depth_range: Annotated[tuple[float, float] | None, number(0, 100, metavar="NEAR FAR")] = None
    """Metres at the ends of the depth colours (default: the range of the recording)."""
    estimate: bool = True
    """Show the segmented hand in another colour if the recording has no true masks."""
    codec: Literal["quick", "web"] = "quick"
    """Video encoding: "quick" for video players; "web" also for browsers, but it takes much longer."""

    sequence: Annotated[Path | None, stated_default(metavar="PATH")] = None
    """Recording of the run, if it was moved."""
