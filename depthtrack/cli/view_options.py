"""The options of `depthtrack view`, for recordings and for runs."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from depthtrack.cli.recording_options import RecordingOptions


@dataclass(frozen=True)
class ViewOptions:
    """What to show, and which files to write."""

    recording: tyro.conf.OmitArgPrefixes[RecordingOptions]
    sheet: Annotated[Path | None, tyro.conf.arg(metavar="FILE.png|.jpg")] = None
    """Write a contact sheet: moments evenly chosen from the recording."""
    strip: Annotated[Path | None, tyro.conf.arg(metavar="FILE.png|.jpg")] = None
    """Write a banner close on the hand: a column a moment; colour, depth, hand and skeleton below each other."""
    video: Annotated[Path | None, tyro.conf.arg(metavar="FILE.mp4")] = None
    """Write a video of the whole recording."""
    rrd: Annotated[Path | None, tyro.conf.arg(metavar="FILE.rrd")] = None
    """Write a recording for the interactive viewer (rerun FILE.rrd opens it)."""
    web: bool = False
    """Serve the interactive viewer to browsers, on all network interfaces, until interrupted."""
    frames: Annotated[tuple[int, ...], tyro.conf.arg(metavar="INDEX...")] = ()
    """Frames to show on sheet and strip, instead of evenly chosen ones."""
    count: Annotated[int | None, tyro.conf.arg(metavar="MOMENTS")] = None
    """How many moments to choose: 12 on a sheet and 7 on a strip unless given."""
    depth_range: Annotated[tuple[float, float] | None, tyro.conf.arg(metavar="NEAR FAR")] = None
    """Metres at the ends of the depth colours; found from the recording unless given."""
    estimate: bool = True
    """Where the recording knows no true mask, show the hand as segmentation finds it, in another colour."""
    codec: Literal["quick", "web"] = "quick"
    """Video encoding: "quick" for video players, "web" for browsers too, which takes much longer."""

    sequence: Annotated[Path | None, tyro.conf.arg(metavar="PATH")] = None
    """Where the recording of a run is, if it was moved since."""
