"""`depthtrack export`: write the joints of a run in another format."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from depthtrack.cli.argument_checks import OUTPUT_FILE
from depthtrack.cli.stated_default import number, stated_default
from depthtrack.errors import InputError
from depthtrack.export.registry import EXPORTERS, export_joints, find_exporter, suffixes

if TYPE_CHECKING:
    from depthtrack.types import Array


@dataclass(frozen=True)
class Command:
    """Write the poses and joints of a run for other programs.

    Tables and arrays hold 21 keypoints in MediaPipe order, in metres, in the camera frame (x right, y down, z forward).
    docs/exports.md states joints, frame and units of each format. Runs of markers are in the frame of the capture.
    """

    path: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(name="run", metavar="RUN")]
    """Run folder from `depthtrack track`, or that of a hand in a folder from `depthtrack markers`."""
    out: Annotated[Path, OUTPUT_FILE, tyro.conf.arg(aliases=("-o",), metavar="OUT" + "|".join(suffixes()))]
    """File to write. Its suffix chooses the format, --format among those that share a suffix."""
    format: Annotated[str | None, stated_default(metavar="|".join(EXPORTERS))] = None
    """Format of the file (default: the one named as its suffix, or the only one with it)."""

    smooth: bool = False
    """Filter the poses over time (one-euro filter). They lag behind, and the delay is printed."""
    smooth_cutoff: Annotated[float | None, number(0.001, 1000, metavar="HZ")] = None
    """Cut-off of --smooth for a hand at rest (default: 4); lower is smoother and later."""

    def run(self) -> None:
        from depthtrack.evaluation.replay import run_hand
        from depthtrack.export.joint_track import JointTrack
        from depthtrack.hand.one_euro import OneEuroOptions
        from depthtrack.markers.folder.contents import run_folder
        from depthtrack.recording.run_folder import Run

        run = Run.load(run_folder(self.path))
        track = JointTrack.of(run, run_hand(run))
        if self.smooth_cutoff is not None and not self.smooth:
            raise InputError("--smooth-cutoff needs --smooth: give both")
        find_exporter(self.out, self.format)
        if self.smooth:
            options = OneEuroOptions() if self.smooth_cutoff is None else OneEuroOptions(self.smooth_cutoff)
            track, delays = track.smoothed(options)
            print(delay_text(delays))
        export_joints(self.out, track, self.format)
        print(f"wrote {self.out}: {len(track.index)} frames, {int(track.posed.sum())} with a pose")


def delay_text(delays: "Array") -> str:
    """Return a line on the delays (T, 3) of a filter, s; NaN in frames without a pose."""
    import numpy as np

    known = 1000 * delays[np.isfinite(delays).all(axis=1)]
    if len(known) == 0:
        return "smoothed: no frame has a pose"
    parts = zip(("position", "orientation", "finger angles"), np.median(known, axis=0), strict=True)
    medians = ", ".join(f"{name} {value:.0f} ms" for name, value in parts)
    return f"smoothed; median delay: {medians}; at most {known.max():.0f} ms"
