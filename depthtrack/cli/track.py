"""`depthtrack track`: a recording's hand, frame by frame, into a run folder."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from depthtrack.cli.hand_options import HandOptions
from depthtrack.cli.progress import counter
from depthtrack.cli.recording_options import RecordingOptions
from depthtrack.cli.tracker_options import IkChoice, PsoChoice, chosen_options
from depthtrack.errors import InputError

if TYPE_CHECKING:
    import numpy as np

    from depthtrack.recording import Sequence


@dataclass(frozen=True)
class Command:
    """Track the hand through a recording and write its pose in every frame to a run folder.

    A run that was interrupted goes on with --resume, and ends with the same poses as one that was not.
    """

    recording: tyro.conf.OmitArgPrefixes[RecordingOptions]
    out: Annotated[Path, tyro.conf.arg(aliases=("-o",), metavar="RUN")]
    """Run folder to write."""
    tracker: Literal["pso", "ik"] = "pso"
    """How to track: pso renders hypotheses (Oikonomidis et al. 2011), ik fits a surface to the point cloud (Schroeder
    et al. 2014)."""
    hands: tyro.conf.OmitArgPrefixes[HandOptions] = field(default_factory=HandOptions)
    start: Literal["auto", "truth"] = "auto"
    """Begin by searching, or from the recording's true pose of its first frame."""
    frames: Annotated[int | None, tyro.conf.arg(metavar="N")] = None
    """Only the first so many frames."""
    resume: bool = False
    """Go on with the run that the folder holds."""
    seed: int = 0
    """Chooses the random numbers: the same seed gives the same poses."""
    skin_model: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """Skin colours learnt by `depthtrack train-skin`; published statistics unless given."""

    variant: Literal["default", "paper"] = "default"
    """The tracker as we measured it best, or as its paper has it."""

    pso: tyro.conf.OmitArgPrefixes[PsoChoice] = field(default_factory=PsoChoice)
    ik: tyro.conf.OmitArgPrefixes[IkChoice] = field(default_factory=IkChoice)

    def run(self) -> None:
        from contextlib import closing

        from depthtrack.cli.output_folder import check_output_folder
        from depthtrack.hand.kinematics import HandModel
        from depthtrack.recording.run_folder import RunWriter
        from depthtrack.segmentation.observation import Segmenter
        from depthtrack.tracking.configuration import run_configuration
        from depthtrack.tracking.pipeline import track_sequence
        from depthtrack.tracking.registry import create_tracker

        check_output_folder(self.out)
        if self.frames is not None and self.frames < 1:
            raise InputError(f"--frames must be at least 1, found {self.frames}")
        sequence = self.recording.open()
        hand = self.hands.chosen(sequence)
        options = self._options()
        configuration = run_configuration(
            self.recording.path,
            sequence,
            hand,
            self.tracker,
            options,
            start=self.start,
            frames=self.frames,
            skin_model=self.skin_model,
            on_damage=self.recording.on_damage,
            threads=options.get("threads"),
        )
        start_pose = self._start_pose(sequence)
        segmenter = Segmenter.for_sequence(sequence, self.skin_model)
        count = len(sequence) if self.frames is None else min(self.frames, len(sequence))
        with (
            closing(create_tracker(self.tracker, hand, **options)) as tracker,
            RunWriter(self.out, configuration, ("segment", *tracker.stages), self.resume) as run,
            counter(count, initial=len(run.rows), leave=True) as bar,
        ):
            bar.set_postfix_str("the first use compiles kernels")
            for row in track_sequence(sequence, segmenter, tracker, HandModel(hand), run, start_pose, count):
                bar.update()
                bar.set_postfix_str(row.status)
        lost = sum(not row.status.is_trusted for row in run.rows)
        print(f"{self.out}: {len(run.rows)} frames, {lost} without a trusted pose")
        print(f"see how good they are:  depthtrack evaluate {self.out}")
        if (note := self.hands.note(sequence, self.recording.path)) is not None:
            print(note)

    def _options(self) -> dict[str, Any]:
        """What the chosen tracker is made with: what was given, and what it would do anyway."""
        from depthtrack.machine import usable_cores
        from depthtrack.tracking.registry import complete_options

        given = {"variant": self.variant, "seed": self.seed} | chosen_options(self.tracker, self.pso, self.ik)
        if self.tracker == "pso":
            given.setdefault("threads", usable_cores())
        return complete_options(self.tracker, given)

    def _start_pose(self, sequence: "Sequence") -> "np.ndarray | None":
        if self.start == "auto":
            return None
        truth = sequence.ground_truth
        row = None if truth is None else truth.at(float(sequence.timestamps[0]))
        if truth is None or truth.poses is None or row is None:
            raise InputError(f"{self.recording.path} knows no true pose of its first frame: use --start auto")
        return truth.poses[row]
