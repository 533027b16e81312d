"""`depthtrack export`: the joints of a run, for other programs."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro


@dataclass(frozen=True)
class Command:
    """Write what a run says of the hand: the pose and 21 keypoints in MediaPipe's order, metres in the camera frame (x
    right, y down, z forward), a row a frame.
    """

    path: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(name="run", metavar="RUN")]
    """A run folder written by `depthtrack track`."""
    out: Annotated[Path, tyro.conf.arg(aliases=("-o",), metavar="OUT.csv|.npz|.txt")]
    """The file to write: a table, numpy arrays, or a benchmark's text (u v d of each joint, pixels and millimetres)."""
    benchmark: Annotated[Literal["nyu", "icvl", "msra"] | None, tyro.conf.arg(metavar="nyu|icvl|msra")] = None
    """Whose joints and camera a .txt file is for."""

    def run(self) -> None:
        import numpy as np

        from depthtrack.evaluation.replay import run_hand
        from depthtrack.export.benchmark_joints import find_benchmark
        from depthtrack.export.joint_track import JointTrack
        from depthtrack.export.registry import export_joints
        from depthtrack.recording.run_folder import Run

        run = Run.load(self.path)
        track = JointTrack.of(run, run_hand(run))
        export_joints(self.out, track, None if self.benchmark is None else find_benchmark(self.benchmark))
        posed = int(np.isfinite(track.poses).all(axis=1).sum())
        print(f"wrote {self.out}: {len(track.index)} frames, {posed} with a pose")
