"""`depthtrack export`: write the joints of a run in another format."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from depthtrack.cli.argument_checks import OUTPUT_FILE
from depthtrack.cli.stated_default import stated_default
from depthtrack.export.registry import EXPORTERS, export_joints, suffixes


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

    def run(self) -> None:
        from depthtrack.evaluation.replay import run_hand
        from depthtrack.export.joint_track import JointTrack
        from depthtrack.markers.folder.contents import run_folder
        from depthtrack.recording.run_folder import Run

        run = Run.load(run_folder(self.path))
        track = JointTrack.of(run, run_hand(run))
        export_joints(self.out, track, self.format)
        print(f"wrote {self.out}: {len(track.index)} frames, {int(track.posed.sum())} with a pose")
