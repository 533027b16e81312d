"""`depthtrack bench`: how fast this machine is at it, beside what one would use instead."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from depthtrack.cli.progress import bar
from depthtrack.errors import DepthtrackError
from depthtrack.files import write_atomic

if TYPE_CHECKING:
    from types import ModuleType


@dataclass(frozen=True)
class _Benchmark:
    seconds: float = 1.0
    """Time spent on each row of the table; the best and the median call count."""
    json: bool = False
    """Print JSON instead of a table."""
    out: Annotated[Path | None, tyro.conf.arg(metavar="FILE.json")] = None
    """Write the JSON to a file as well."""

    def _measure(self, benchmark: "ModuleType", plan: Any) -> None:
        """Run and report. `benchmark` has `run(plan, progress)`, which measures, and `as_text(report)`, which tells it
        to people; the report, a dataclass, has `rows`, and none where nothing could run."""
        from dataclasses import asdict
        from json import dumps

        report = benchmark.run(plan, lambda rows: bar(rows, "row", plan.row_count))
        text = dumps(asdict(report), indent=2)
        if self.out is not None:
            write_atomic(self.out, text + "\n")
        print(text if self.json else benchmark.as_text(report))
        if not report.rows:
            raise DepthtrackError("nothing asked for can run here: the reasons are above")


@dataclass(frozen=True)
class Score(_Benchmark):
    """From poses to energies, kinematics and objective included, in hypotheses a second.

    For every backend that runs here, at the sensor's resolution and at 96 and 64 pixels a side; and, where they are
    installed, for pyrender, Open3D and embree on a mesh of the same hand.
    """

    backends: Annotated[tuple[str, ...] | None, tyro.conf.arg(metavar="NAME ...")] = None
    """Only these, of raster, egl, osmesa, oracle, pyrender, open3d, embree; unless told, all but the slow oracle."""

    def run(self) -> None:
        from depthtrack.benchmarks.speed import scoring

        self._measure(scoring, scoring.plan(self.backends, self.seconds))


@dataclass(frozen=True)
class Ik(_Benchmark):
    """From a segmented depth map to a pose by fitting the hand's surface, on one core, in frames a second.

    For the skin and the cylinders, all residuals, 26 and 6+6 degrees of freedom, and several numbers of points.
    """

    def run(self) -> None:
        from depthtrack.benchmarks.speed import ik

        self._measure(ik, ik.plan(self.seconds))


@dataclass(frozen=True)
class Segment(_Benchmark):
    """From an RGB-D frame to the hand cut out of it, following it from the frame before, on one core.

    For synthetic recordings of every camera, or recordings of your own, with colour and by depth alone.
    """

    recordings: Annotated[tuple[Path, ...], tyro.conf.arg(metavar="FOLDER ...")] = ()
    """Sequence folders with a hand in their first frames, in place of the synthetic ones."""

    def run(self) -> None:
        from depthtrack.benchmarks.speed import segmenting

        self._measure(segmenting, segmenting.plan(self.recordings, self.seconds))


@dataclass(frozen=True)
class Command:
    """Measure speed on this machine."""

    what: tyro.conf.OmitSubcommandPrefixes[
        Annotated[Score, tyro.conf.subcommand("score")]
        | Annotated[Ik, tyro.conf.subcommand("ik")]
        | Annotated[Segment, tyro.conf.subcommand("segment")]
    ]

    def run(self) -> None:
        self.what.run()
