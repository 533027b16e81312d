"""`depthtrack bench`: measure speed on this machine, beside alternative libraries."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from depthtrack.cli.argument_checks import OUTPUT_FILE
from depthtrack.cli.progress import bar
from depthtrack.cli.recording_options import RecordingOptions
from depthtrack.cli.stated_default import number, stated_default
from depthtrack.errors import DepthtrackError
from depthtrack.files import write_atomic
from depthtrack.ranges import MOST_SEED

if TYPE_CHECKING:
    from types import ModuleType


@dataclass(frozen=True)
class _Benchmark:
    seconds: Annotated[float, number(0.01, 3600)] = 1.0
    """Duration of the measurement for each row. The table gives the best and the median call."""
    json: bool = False
    """Print JSON instead of a table."""
    out: Annotated[Path | None, OUTPUT_FILE, stated_default(metavar="FILE.json")] = None
    """Also write the JSON to a file."""

    def _measure(self, benchmark: "ModuleType", plan: Any) -> None:
        print_measured(benchmark, plan, self.json, self.out)


def print_measured(benchmark: "ModuleType", plan: Any, json: bool, out: Path | None) -> None:
    """Run a benchmark and print its report.

    benchmark: module with `run(plan, progress) -> report` and `as_text(report) -> str`. The report is a dataclass with
        `rows`.

    Raises:
        DepthtrackError: if the report has no rows.
    """
    from dataclasses import asdict

    from depthtrack.strict_data import json_text

    report = benchmark.run(plan, lambda rows: bar(rows, "row", plan.row_count))
    text = json_text(asdict(report), indent=2)
    if out is not None:
        write_atomic(out, text + "\n")
    print(text if json else benchmark.as_text(report))
    if not report.rows:
        raise DepthtrackError("none of the requested backends runs here: the reasons are above")


@dataclass(frozen=True)
class Score(_Benchmark):
    """Measure scored hypotheses per second: kinematics, rendering and objective.

    Each backend runs at the sensor's resolution and at 96 and 64 pixels per side. If installed, pyrender, Open3D and
    embree run on a mesh of the same hand.
    """

    backends: Annotated[tuple[str, ...] | None, stated_default(metavar="NAME ...")] = None
    """Backends to measure: raster, egl, osmesa, oracle, pyrender, open3d, embree (default: all but the oracle)."""

    def run(self) -> None:
        from depthtrack.benchmarks.speed import scoring

        self._measure(scoring, scoring.plan(self.backends, self.seconds))


@dataclass(frozen=True)
class Ik(_Benchmark):
    """Measure frames per second of the surface fit, from segmented depth to pose, on one core.

    The rows differ in surface (skin, cylinders), residual, degrees of freedom (26, 6+6) and number of points.
    """

    def run(self) -> None:
        from depthtrack.benchmarks.speed import ik

        self._measure(ik, ik.plan(self.seconds))


@dataclass(frozen=True)
class Segment(_Benchmark):
    """Measure the time to segment the hand in an RGB-D frame on one core.

    The recordings are synthetic, one per camera, or your own. Each is measured with colour and with depth alone.
    """

    recordings: Annotated[tuple[Path, ...], stated_default(metavar="FOLDER ...")] = ()
    """Recordings that show a hand in their first frames (default: synthetic ones)."""

    def run(self) -> None:
        from depthtrack.benchmarks.speed import segmenting

        self._measure(segmenting, segmenting.plan(self.recordings, self.seconds))


@dataclass(frozen=True)
class Markers(_Benchmark):
    """Measure frames per second of the online labelling of markers on one core.

    It runs from points to labels and poses. The scenes are a hand of 26 markers, and two hands of 13 with three rigid
    bodies of 3.
    """

    def run(self) -> None:
        from depthtrack.benchmarks.speed import markers

        self._measure(markers, markers.plan(self.seconds))


@dataclass(frozen=True)
class Pipeline:
    """Measure the time of each frame from the reading of a file to the pose, and of each stage.

    The frames per second are those of wall-clock time. Reading runs ahead in a thread, as in `depthtrack track`.
    """

    recording: tyro.conf.OmitArgPrefixes[RecordingOptions]
    trackers: Annotated[tuple[str, ...], stated_default(metavar="NAME ...")] = ("hybrid", "ik", "pso")
    """Trackers to measure."""
    hand: Annotated[str | None, stated_default(metavar="HAND")] = None
    """Hand to track with: a file, "truth" or "average" (default: the recording's own, or the average one)."""
    frames: Annotated[int | None, number(2, 10**9), stated_default(metavar="N")] = None
    """Track only the first N frames (default: all)."""
    threads: Annotated[int | None, number(1, 256), stated_default(metavar="N")] = None
    """Threads of renderer and fits (default: one per core)."""
    deadline: Annotated[float | None, number(0, 3_600_000), stated_default(metavar="MS")] = None
    """Time after a frame arrives at which searches end, of `hybrid` and `ik` (default: none)."""
    json: bool = False
    """Print JSON instead of a table."""
    out: Annotated[Path | None, OUTPUT_FILE, stated_default(metavar="FILE.json")] = None
    """Also write the JSON to a file."""

    def run(self) -> None:
        from depthtrack.benchmarks.speed import pipeline
        from depthtrack.machine import usable_cores

        threads = self.threads or usable_cores()
        path, sequence = self.recording.path, self.recording.open(tracked=True)
        plan = pipeline.plan(path, sequence, self.trackers, self.hand, self.frames, threads, self.deadline)
        print_measured(pipeline, plan, self.json, self.out)


@dataclass(frozen=True)
class Starts:
    """Measure how often the markers of hands are found in a single frame of points.

    A row has the share of right starts, the same among the sure ones, and that of the method of Maycock et al. 2015.
    """

    layouts: Annotated[tuple[str, ...], stated_default(metavar="LAYOUT ...")] = ("13", "16", "19", "26")
    """Layouts of the synthetic frames."""
    trials: Annotated[int, number(1, 10**6)] = 36
    """Frames a row: of synthetic motions, or spread over the capture."""
    seed: Annotated[int, number(0, MOST_SEED)] = 1000
    """Seed of the first frame."""
    capture: Annotated[Path | None, stated_default(metavar="CAPTURE")] = None
    """Labelled capture to use without its labels, in place of synthetic frames."""
    models: Annotated[tuple[str, ...], stated_default(aliases=("-m",), metavar="MODEL ...")] = ()
    """Models to find in the capture: layouts such as left:16, or files from `markers model`."""
    json: bool = False
    """Print JSON instead of a table."""
    out: Annotated[Path | None, OUTPUT_FILE, stated_default(metavar="FILE.json")] = None
    """Also write the JSON to a file."""

    def run(self) -> None:
        from depthtrack.benchmarks import marker_starts

        plan = marker_starts.plan(self.layouts, self.trials, self.seed, self.capture, self.models)
        print_measured(marker_starts, plan, self.json, self.out)


@dataclass(frozen=True)
class Command:
    """Measure speed, or the share of right starts, on this machine."""

    measurement: tyro.conf.OmitSubcommandPrefixes[
        Annotated[Score, tyro.conf.subcommand("score")]
        | Annotated[Ik, tyro.conf.subcommand("ik")]
        | Annotated[Segment, tyro.conf.subcommand("segment")]
        | Annotated[Markers, tyro.conf.subcommand("markers")]
        | Annotated[Pipeline, tyro.conf.subcommand("pipeline")]
        | Annotated[Starts, tyro.conf.subcommand("starts")]
    ]

    def run(self) -> None:
        self.measurement.run()
