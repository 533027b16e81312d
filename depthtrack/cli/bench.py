"""`depthtrack bench`: measure speed on this machine, beside alternative libraries."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from depthtrack.cli.progress import bar
from depthtrack.cli.stated_default import stated_default
from depthtrack.errors import DepthtrackError
from depthtrack.files import write_atomic

if TYPE_CHECKING:
    from types import ModuleType


@dataclass(frozen=True)
class _Benchmark:
    seconds: float = 1.0
    """Duration of the measurement for each row. The table gives the best and the median call."""
    json: bool = False
    """Print JSON instead of a table."""
    out: Annotated[Path | None, stated_default(metavar="FILE.json")] = None
    """Also write the JSON to a file."""

    def _measure(self, benchmark: "ModuleType", plan: Any) -> None:
        """Run a benchmark and print its report.

        benchmark: module with `run(plan, progress) -> report` and `as_text(report) -> str`. The report is a dataclass
            with `rows`.

        Raises:
            DepthtrackError: if the report has no rows.
        """
        from dataclasses import asdict
        from json import dumps

        report = benchmark.run(plan, lambda rows: bar(rows, "row", plan.row_count))
        text = dumps(asdict(report), indent=2)
        if self.out is not None:
            write_atomic(self.out, text + "\n")
        print(text if self.json else benchmark.as_text(report))
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
    """Measure frames per second of the online labelling of markers, from points to labels and poses, on one core.

    The scenes are a hand of 26 markers, and two hands of 13 with three rigid bodies of 3.
    """

    def run(self) -> None:
        from depthtrack.benchmarks.speed import markers

        self._measure(markers, markers.plan(self.seconds))


@dataclass(frozen=True)
class Command:
    """Measure speed on this machine."""

    what: tyro.conf.OmitSubcommandPrefixes[
        Annotated[Score, tyro.conf.subcommand("score")]
        | Annotated[Ik, tyro.conf.subcommand("ik")]
        | Annotated[Segment, tyro.conf.subcommand("segment")]
        | Annotated[Markers, tyro.conf.subcommand("markers")]
    ]

    def run(self) -> None:
        self.what.run()
