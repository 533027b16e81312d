"""`depthtrack track`: track the hand of a recording and write a run folder."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from depthtrack.cli.argument_checks import OUTPUT_FOLDER
from depthtrack.cli.config_options import chosen_config, options_type
from depthtrack.cli.hand_options import HandOptions, other_side_text, quick_side, side_text
from depthtrack.cli.reading_arguments import ReadingArguments
from depthtrack.cli.recording_options import RecordingOptions
from depthtrack.cli.segmentation_options import SegmentationArguments, SegmentationShortcuts
from depthtrack.cli.stated_default import number, stated_default
from depthtrack.cli.tracker_options import requested_run, requested_tracker
from depthtrack.errors import DepthtrackError
from depthtrack.segmentation.options import SegmentationOptions
from depthtrack.tracking.configuration import TrackerConfig, TrackerName

if TYPE_CHECKING:
    from depthtrack.hand.shape import HandShape
    from depthtrack.recording.sequence import Sequence as Recording
    from depthtrack.tracking.backward_options import BackwardOptions
    from depthtrack.tracking.run_configuration import RunConfiguration


@dataclass(frozen=True)
class TrackCommand:
    """Track the hand through a recording and write its pose in every frame to a run folder.

    An interrupted run continues with --resume and ends with the same poses. --config repeats a run: options given
    beside it replace those of the run. The options of the tracker and of the segmentation follow those of the command.
    `--tracker NAME --help` lists those of another tracker, and docs/parameters.md all of them.
    """

    recording: tyro.conf.OmitArgPrefixes[RecordingOptions]
    out: Annotated[Path, OUTPUT_FOLDER, tyro.conf.arg(aliases=("-o",), metavar="RUN")]
    """Run folder to write."""
    tracker: TrackerName
    """Tracker: ik fits a surface to the point cloud, pso renders hypotheses, hybrid does both; the others are those of
    the papers."""
    config: Annotated[Path | None, stated_default(metavar="RUN.json")] = None
    """Configuration to repeat: the run.json of a run, or its folder."""
    hands: tyro.conf.OmitArgPrefixes[HandOptions] = dataclasses.field(default_factory=HandOptions)
    start: Literal["auto", "truth"] = "auto"
    """Start with a search, or from the recording's true pose of its first frame."""
    frames: Annotated[int | None, number(1, 10**7, metavar="N")] = None
    """Track only the first N frames."""
    keypoints: Annotated[Path | None, stated_default(metavar="FILE.csv")] = None
    """2D keypoints of the hand from another detector (docs/keypoints.md)."""
    backward: Literal["auto", "yes", "no"] = "auto"
    """Track doubtful stretches backwards as well, from the confident pose after them. `auto` does so, but not with a
    deadline or a tracker of the papers; with --config it does as that run did."""
    resume: bool = False
    """Continue the run that the folder holds."""
    threads: Annotated[int | None, number(1, 1024, metavar="N")] = None
    """Threads of renderer and fits (default: one per core). Poses do not depend on it."""
    segmentation_shortcuts: tyro.conf.OmitArgPrefixes[SegmentationShortcuts] = dataclasses.field(
        default_factory=SegmentationShortcuts
    )

    @property
    def tracker_config(self) -> TrackerConfig:
        """Configuration of the tracker."""
        raise NotImplementedError

    @property
    def segmentation_options(self) -> SegmentationOptions:
        """Options of the segmentation."""
        raise NotImplementedError

    def run(self) -> None:
        from depthtrack.cli.warmup import compiled_ahead

        tracker = self.tracker_config  # checked before the recording is opened
        with compiled_ahead(tracker.name, self._stored is None and self.hands.hand is None) as wait_for_kernels:
            sequence = self._open()
            configuration = self._configuration(sequence, tracker)
            wait_for_kernels()
            if self._stored is None:
                configuration = dataclasses.replace(configuration, hand=self._hand(sequence).to_fields())
            rate = self._track(sequence, configuration)
        self._report(sequence, rate)

    def _track(self, sequence: "Recording", configuration: "RunConfiguration") -> str:
        """Write the run folder; return the rate."""
        from time import perf_counter

        from depthtrack.cli.progress import counter
        from depthtrack.machine import usable_cores
        from depthtrack.tracking.run import TrackingRun

        with (
            TrackingRun(configuration, sequence, self.threads or usable_cores()) as run,
            counter(len(run), leave=True) as shown,
        ):
            shown.set_postfix_str("the first use compiles kernels")
            times = []
            for each in run.write(
                self.out,
                self.resume,
                lambda done, total: shown.set_postfix_str(f"backwards {done} of {total} doubtful frames"),
            ):
                times.append(perf_counter())
                shown.update(each.frame.index + 1 - shown.n)
                shown.set_postfix_str(each.estimate.status)
        return _rate_text(times)

    def _open(self) -> "Recording":
        """Return the recording, seen through the camera of `--config` unless another one is given."""
        repeated = None if self.config is None else _load(self.config).camera_model()
        return self.recording.open(repeated, tracked=True)

    @cached_property
    def _stored(self) -> "HandShape | None":
        """Hand of the run that is repeated or resumed, unless another one is given."""
        if self.hands != HandOptions():
            return None
        if self.config is not None:
            return _load(self.config).hand_shape(str(self.config))
        if not (self.resume and (self.out / "run.json").exists()):
            return None
        from depthtrack.recording.run_folder import read_configuration
        from depthtrack.tracking.run_configuration import RunConfiguration

        where = str(self.out / "run.json")
        return RunConfiguration.from_fields(read_configuration(self.out), where).hand_shape(where)

    def _hand(self, sequence: "Recording") -> "HandShape":
        """Return the hand to track with: a stored, a given or a measured one."""
        if self._stored is not None:
            return self._stored
        options, segmentation = self.hands, self.segmentation_options
        if (measured := options.measured(sequence, segmentation, self.threads, self.frames)) is not None:
            return measured
        choice = options.choose_side(sequence, segmentation, self.threads, self.frames)
        if choice is not None:
            print(side_text(choice), flush=True)
        return options.chosen(sequence, choice)

    def _configuration(self, sequence: "Recording", tracker: TrackerConfig) -> "RunConfiguration":
        """Return the checked configuration, with the stored, given or average hand."""
        from depthtrack.tracking.run import check_run, configure

        configuration = configure(
            self.recording.path,
            sequence,
            tracker,
            self._stored or self.hands.chosen(sequence),
            self.segmentation_options,
            start=self.start,
            frames=self.frames,
            on_damage=self.recording.on_damage,
            keypoints=None if self.keypoints is None else str(self.keypoints.resolve()),
            backward=self._backward(tracker),
        )
        # To measure the hand takes long, so everything else is checked before.
        check_run(configuration, sequence, self.out, self.resume)
        return configuration

    def _backward(self, tracker: TrackerConfig) -> "BackwardOptions | None":
        """Return the options of the backward pass: of the run that is repeated, or the usual ones."""
        from depthtrack.tracking.backward_options import chosen_backward

        stored = None if self.config is None else _load(self.config).backward
        if self.backward == "auto" and self.config is not None:
            return stored
        choice = {"auto": None, "yes": stored or True, "no": False}[self.backward]
        return chosen_backward(choice, tracker)

    def _report(self, sequence: "Recording", rate: str) -> None:
        import numpy as np

        from depthtrack.recording.depth_checks import no_hand_note, poor_agreement_note
        from depthtrack.recording.frame_failures import FAILURES_FILE, read_failures
        from depthtrack.recording.run_folder import backward_frames
        from depthtrack.recording.run_rows import FORWARD_FILE, read_rows

        rows, failures = read_rows(self.out), read_failures(self.out)
        if failures and len(failures) == len(rows):
            raise DepthtrackError(f"each of {len(rows)} frames failed: {next(iter(failures.values()))}")
        untrusted = sum(not row.status.is_trusted for row in rows)
        explained = np.array([row.agreement for row in rows if row.pose is not None])
        if sequence.has_depth and untrusted == len(rows):
            print(no_hand_note(sequence))
        elif sequence.has_depth and (poor := poor_agreement_note(sequence, explained)) is not None:
            print(poor)
        elif self.hands.given_side is not None:
            choice = quick_side(sequence, self.segmentation_options, self.threads or 1, self.frames)
            if (better := other_side_text(choice, self.hands.given_side)) is not None:
                print(better)
        backward = len(backward_frames(self.out, rows))
        replaced = (
            f", {backward} tracked backwards ({self.out / FORWARD_FILE} has all forward poses)" if backward else ""
        )
        failed = f", {len(failures)} failed unexpectedly ({self.out / FAILURES_FILE})" if failures else ""
        print(f"{self.out}: {len(rows)} frames, {untrusted} without a trusted pose{replaced}{failed}{rate}")
        print(f"errors and timing:  depthtrack evaluate {self.out}")


def _rate_text(times: Sequence[float]) -> str:
    """Return the frames per second of wall-clock time, "" for less than two frames.

    times: seconds at which each frame was written. The first frame, with its search, does not count.
    """
    return f", {(len(times) - 1) / (times[-1] - times[0]):.0f} frames a second" if len(times) > 1 else ""


def command(arguments: Sequence[str]) -> tuple[type[TrackCommand], TrackCommand]:
    """Return the command with the options of the tracker in the arguments, and its defaults.

    The defaults are those of the run that `--config` names, if any.

    Raises:
        InputError: no tracker has this name, or `--config` names no run.
    """
    run = requested_run(arguments)
    config = requested_tracker(arguments, run)
    options = options_type(config, arguments)
    segmentation = SegmentationArguments(arguments, None if run is None else run.segmentation)
    field = ("tracking", Annotated[options, tyro.conf.OmitArgPrefixes], dataclasses.field(default_factory=options))
    namespace = {
        "__doc__": TrackCommand.__doc__,
        "tracker_config": property(lambda self: chosen_config(config, self.tracking)),
        "segmentation_options": property(
            lambda self: segmentation.chosen(self.segmentation, self.segmentation_shortcuts)
        ),
    }
    fields = [field, segmentation.field]
    Command = dataclasses.make_dataclass("Command", fields, bases=(TrackCommand,), frozen=True, namespace=namespace)
    defaults: dict[str, Any] = {"tracker": config.name}
    recording = RecordingOptions(tyro.MISSING)
    if run is not None:
        defaults |= {"start": run.start, "frames": run.frames}
        defaults |= {"keypoints": None if run.keypoints is None else Path(run.keypoints)}
        reading = ReadingArguments.of(run.reading)
        recording = dataclasses.replace(recording, on_damage=run.on_damage, reading=reading)
    return Command, Command(recording=recording, out=tyro.MISSING, **defaults)


def _load(path: Path) -> "RunConfiguration":
    from depthtrack.tracking.run_configuration import RunConfiguration

    return RunConfiguration.load(path)
