"""`depthtrack export`: write the joints of a run in another format."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from depthtrack.cli.stated_default import stated_default
from depthtrack.export.registry import EXPORTERS, export_joints, suffixes


@dataclass(frozen=True)
class Command:
    """Write the pose and the 21 keypoints of each frame of a run.

    Keypoints are in MediaPipe order, in metres, in the camera frame (x right, y down, z forward). Those of markers are
    in the frame of the capture.
    """

    path: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(name="run", metavar="RUN")]
    """Run folder from `depthtrack track`, or that of a hand in a folder from `depthtrack markers`."""
    out: Annotated[Path, tyro.conf.arg(aliases=("-o",), metavar="OUT" + "|".join(suffixes()))]
    """File to write: a table, numpy arrays, angles for OpenSim (.mot), or a benchmark's text (u v d of joints)."""
    format: Annotated[str | None, stated_default(metavar="|".join(EXPORTERS))] = None
    """Format of the file (default: by its suffix). A .txt file needs the benchmark whose joints and camera it uses."""

    def run(self) -> None:
        import numpy as np

        from depthtrack.evaluation.replay import run_hand
        from depthtrack.export.joint_track import JointTrack
        from depthtrack.markers.folder.contents import run_folder
        from depthtrack.recording.run_folder import Run

        run = Run.load(run_folder(self.path))
        track = JointTrack.of(run, run_hand(run))
        export_joints(self.out, track, self.format)
        posed = int(np.isfinite(track.poses).all(axis=1).sum())
        print(f"wrote {self.out}: {len(track.index)} frames, {posed} with a pose")
