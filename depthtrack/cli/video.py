"""`depthtrack video`: write a video of a run."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from depthtrack.cli.argument_checks import VIDEO
from depthtrack.cli.progress import bar
from depthtrack.cli.stated_default import number, stated_default
from depthtrack.errors import InputError


@dataclass(frozen=True)
class Command:
    """Write a video of a run: hand over colour and depth, residual, skeletons; or of markers.

    The true skeleton is drawn if the recording has one. Below are the status of the tracker and the energy over time.
    A folder from `depthtrack markers` is drawn as the hands with their markers.
    """

    path: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(name="run", metavar="RUN")]
    """Run folder from `depthtrack track`, or folder from `depthtrack markers`."""
    out: Annotated[Path, VIDEO, tyro.conf.arg(aliases=("-o",), metavar="OUT.mp4")]
    """Video to write."""
    sequence: Annotated[Path | None, stated_default(metavar="PATH")] = None
    """Recording of the run, if it was moved."""
    height: Annotated[int, number(48, 1080, metavar="PIXELS")] = 360
    """Height of each of the four views."""
    speed: Annotated[float, number(0.01, 100)] = 1.0
    """Factor on the playback speed."""
    codec: Literal["quick", "web"] = "quick"
    """Video encoding: "quick" for video players; "web" also for browsers, but it takes much longer."""

    def run(self) -> None:
        from depthtrack.cli.view_markers import open_scene, write_video
        from depthtrack.evaluation.replay import Replay
        from depthtrack.markers.folder.contents import is_marker_folder
        from depthtrack.recording.run_folder import Run
        from depthtrack.viewing.run_video import write_run_video
        from depthtrack.viewing.video import WEB_CODECS

        codecs = WEB_CODECS if self.codec == "web" else None
        if is_marker_folder(self.path):
            write_video(open_scene(self.path), self.out, codecs, 2 * self.height, self.speed)
            return
        replay = Replay.open(Run.load(self.path), self.sequence)
        count = write_run_video(replay, self.out, codecs, self.height, bar, self.speed)
        if count == 0:
            raise InputError(f"the run {self.path} has no frame to show: choose another run")
        print(f"wrote the video {self.out}: {count} frames")
