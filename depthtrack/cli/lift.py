"""`depthtrack lift`: turn 2D keypoints and depth images into metric poses of a hand."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from depthtrack.cli.argument_checks import OUTPUT_FOLDER
from depthtrack.cli.recording_options import RecordingOptions
from depthtrack.cli.stated_default import number, stated_default
from depthtrack.errors import InputError

if TYPE_CHECKING:
    from depthtrack.hand.shape import HandShape
    from depthtrack.recording import Sequence
    from depthtrack.recording.keypoints import KeypointFile


@dataclass(frozen=True)
class KeypointsArgument:
    """File of keypoints, after the recording."""

    keypoints: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="KEYPOINTS.csv")]
    """2D keypoints of the hand in the depth images (docs/keypoints.md)."""


@dataclass(frozen=True)
class Command:
    """Lift 2D keypoints of another detector to metric poses of a hand, with the depth images.

    The poses go to a run folder, as those of `track`. Without --hand, the size of the hand is that of the keypoints
    over the whole recording, and its bones keep their lengths. Frames without enough keypoints are absent.
    """

    recording: tyro.conf.OmitArgPrefixes[RecordingOptions]
    file: tyro.conf.OmitArgPrefixes[KeypointsArgument]
    out: Annotated[Path, OUTPUT_FOLDER, tyro.conf.arg(aliases=("-o",), metavar="RUN")]
    """Run folder to write."""
    hand: Annotated[str | None, stated_default(metavar="HAND.json|RIG.glb|truth")] = None
    """A hand file, a rigged mesh, or the recording's own sizes (default: sizes of the keypoints)."""
    side: Literal["auto", "file", "right", "left"] = "auto"
    """Side of the hand. `auto` lifts both sides in up to 60 frames and takes the one that fits better; `file` takes the
    side of most rows."""
    refine: bool = True
    """Fit the lifted poses to the surface, and keep those with a lower energy."""
    frames: Annotated[int | None, number(1, 10**7, metavar="N")] = None
    """Lift only the first N frames."""
    resume: bool = False
    """Continue the run that the folder holds."""
    threads: Annotated[int | None, number(1, 1024, metavar="N")] = None
    """Threads of the renderer (default: one per core). Poses do not depend on it."""

    def run(self) -> None:
        from depthtrack.cli.progress import counter
        from depthtrack.machine import usable_cores
        from depthtrack.recording.keypoints import read_keypoints
        from depthtrack.tracking.configuration import LiftConfig
        from depthtrack.tracking.run import TrackingRun, configure

        sequence, keypoints = self.recording.open(tracked=True), read_keypoints(self.file.keypoints)
        configuration = configure(
            self.recording.path,
            sequence,
            LiftConfig(refine=self.refine),
            self._hand(sequence, keypoints),
            frames=self.frames,
            on_damage=self.recording.on_damage,
            keypoints=str(self.file.keypoints.resolve()),
        )
        with (
            TrackingRun(configuration, sequence, self.threads or usable_cores()) as run,
            counter(len(run), leave=True) as shown,
        ):
            for each in run.write(self.out, resume=self.resume):
                shown.update(each.frame.index + 1 - shown.n)
        self._report(sequence, keypoints)

    def _hand(self, sequence: "Sequence", keypoints: "KeypointFile") -> "HandShape":
        """Return the hand to lift. Raises InputError."""
        from depthtrack.calibration.lifted_hand import measure_lifted_hand
        from depthtrack.recording.hand_choice import chosen_hand

        stated = keypoints.side if self.side == "file" else None if self.side == "auto" else self.side
        if self.side == "file" and stated is None:
            raise InputError(
                f"{self.file.keypoints} must state a side for --side file, found none: give another --side"
            )
        if self.hand is not None:
            return chosen_hand(sequence, self.hand, stated)
        measured = measure_lifted_hand(sequence, keypoints, stated)
        costs = ", ".join(f"{side} {cost:.2f}" for side, cost in measured.costs.items())
        hand = measured.hand
        print(
            f"a {hand.side} hand of {hand.scale:.2f} times the average size (cost of the keypoints: {costs})",
            flush=True,
        )
        return hand

    def _report(self, sequence: "Sequence", keypoints: "KeypointFile") -> None:
        """Print the number of lifted frames, and the residual in pixels."""
        import numpy as np

        from depthtrack.evaluation.keypoint_residuals import keypoint_residuals
        from depthtrack.recording.run_folder import Run

        run = Run.load(self.out)
        residuals = keypoint_residuals(run, sequence.camera, sequence.timestamps, keypoints)
        absent = sum(status == "absent" for status in run.status)
        lost = sum(status == "lost" for status in run.status)
        print(f"{self.out}: {len(run.index)} frames, {absent} absent, {lost} lost")
        if np.isfinite(residuals).any():
            median, high = np.nanpercentile(residuals, [50, 95])
            print(f"keypoints: {median:.1f} px from those of the file, {high:.1f} px at the 95th percentile of frames")
        print(f"errors and timing:  depthtrack evaluate {self.out}")
