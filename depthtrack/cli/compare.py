"""`depthtrack compare`: run trackers on the same recordings and write a report."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from depthtrack.cli.argument_checks import OUTPUT_FOLDER
from depthtrack.cli.source_options import SourceOptions
from depthtrack.cli.stated_default import number, stated_default
from depthtrack.errors import InputError
from depthtrack.ranges import MOST_SEED

if TYPE_CHECKING:
    from depthtrack.evaluation.compare.comparison import Comparison


@dataclass(frozen=True)
class Command:
    """Track recordings with several trackers and compare them.

    Prints a table and writes results.csv, results.json and report.html to DIR. The runs are stored in DIR/runs. The
    same command continues an interrupted comparison and keeps complete runs. Make the report again with `depthtrack
    evaluate DIR/runs/* --report DIR`. Times are CPU times, since runs share the machine.
    """

    sequences: Annotated[tuple[Path, ...], tyro.conf.Positional, stated_default(metavar="SEQUENCE ...")]
    """Recordings to track."""
    out: Annotated[Path, OUTPUT_FOLDER, tyro.conf.arg(aliases=("-o",), metavar="DIR")]
    """Folder to write to."""
    trackers: Annotated[tuple[str, ...], stated_default(metavar="hybrid,pso,ik")] = ("hybrid,pso,ik",)
    """Trackers, each with options after a colon, as in  hybrid,ik:subsample=2 ; or a .toml file with a
    table per tracker: [label], tracker = "ik", and its options."""
    repeats: Annotated[int, number(1, 1000, metavar="N")] = 1
    """Runs per tracker and recording, each with another seed."""
    equal_time: Annotated[float | None, number(0.01, 10**6, metavar="MS")] = None
    """CPU milliseconds per median frame for every tracker. The work of each is chosen by timing some frames. A search
    after a loss takes extra time. The report warns if even the least work takes longer."""
    seed: Annotated[int, number(0, MOST_SEED)] = 0
    """Seed of the first run."""

    keypoints: Annotated[tuple[Path, ...], stated_default(metavar="FILE.csv ...")] = ()
    """2D keypoints from another detector, a file for each recording in their order (docs/keypoints.md)."""

    recordings: tyro.conf.OmitArgPrefixes[SourceOptions] = field(default_factory=SourceOptions)

    jobs: Annotated[int | None, number(1, 1024, metavar="N")] = None
    """Processes on this machine (default: one per core)."""
    scheduler: Annotated[str | None, stated_default(metavar="ADDRESS")] = None
    """Address of a Dask scheduler, as tcp://127.0.0.1:8786, whose workers track instead (extra: sweep). Each worker
    needs one thread, and the recordings and DIR under the same paths."""
    json: bool = False
    """Print results.json instead of the table."""

    def run(self) -> None:
        from depthtrack.cli.comparing import compare_and_report
        from depthtrack.evaluation.sweep.workers import chosen_workers

        workers = chosen_workers(self.jobs, self.scheduler)
        compare_and_report(self._comparison(), self.out, workers, as_json=self.json)

    def _comparison(self) -> "Comparison":
        from depthtrack.evaluation.compare.comparison import Comparison
        from depthtrack.evaluation.compare.specs import read_specs

        if self.keypoints and len(self.keypoints) != len(self.sequences):
            raise InputError(
                f"--keypoints needs a file for each recording, found {len(self.keypoints)} for {len(self.sequences)}"
            )
        files: list[str | None] = [str(file.resolve()) for file in self.keypoints]
        files = files or [None] * len(self.sequences)
        sources = (
            replace(self.recordings.checked(self.recordings.source(each)), keypoints=file)
            for each, file in zip(self.sequences, files, strict=True)
        )
        return Comparison(
            sources=tuple(map(self.recordings.with_side, sources)),
            specs=tuple(read_specs(self.trackers)),
            repeats=self.repeats,
            seed=self.seed,
            equal_ms=self.equal_time,
        )
