"""`depthtrack compare`: trackers side by side on the same recordings, and a report that says which to take."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from depthtrack.cli.source_options import SourceOptions

if TYPE_CHECKING:
    from depthtrack.evaluation.compare.comparison import Comparison


@dataclass(frozen=True)
class Command:
    """Track recordings with several trackers, and compare: a table here; results.csv, results.json and report.html.

    The runs lie in DIR/runs. What was interrupted goes on where it stood when the same command is given again; runs
    that are whole are kept. `depthtrack evaluate DIR/runs/* --report DIR` makes the report again. Times are CPU times,
    for runs share the machine.
    """

    sequences: Annotated[tuple[Path, ...], tyro.conf.Positional, tyro.conf.arg(metavar="SEQUENCE ...")]
    """Recordings."""
    out: Annotated[Path, tyro.conf.arg(aliases=("-o",), metavar="DIR")]
    """Folder to write to."""
    trackers: Annotated[tuple[str, ...], tyro.conf.arg(metavar="pso,ik")] = ("pso,ik",)
    """Trackers, with options where wanted, as in  pso,ik,ik:variant=paper,rounds=8 ; or a .toml file with a table for
    each: [label], tracker = "ik", and its options."""
    repeats: Annotated[int, tyro.conf.arg(metavar="N")] = 1
    """Times that every tracker goes through every recording, each time with another seed."""
    equal_time: Annotated[float | None, tyro.conf.arg(metavar="MS")] = None
    """Give every tracker the same CPU milliseconds an ordinary frame: its work is chosen by timing a few. Frames in
    doubt cost a search besides; where even the least work takes longer, the report says so."""
    seed: int = 0
    """The first seed."""

    recordings: tyro.conf.OmitArgPrefixes[SourceOptions] = field(default_factory=SourceOptions)

    jobs: Annotated[int | None, tyro.conf.arg(metavar="N")] = None
    """Processes on this machine; as many as there are cores unless given."""
    scheduler: Annotated[str | None, tyro.conf.arg(metavar="ADDRESS")] = None
    """A Dask scheduler, as tcp://127.0.0.1:8786, whose workers (one thread each) track instead (extra: sweep). They
    must see the recordings and DIR under the same paths."""
    json: bool = False
    """Print results.json instead of the table."""

    def run(self) -> None:
        from depthtrack.cli.comparing import compare_and_report
        from depthtrack.evaluation.sweep.workers import chosen_workers

        comparison = self._comparison()
        compare_and_report(comparison, self.out, chosen_workers(self.jobs, self.scheduler), as_json=self.json)

    def _comparison(self) -> "Comparison":
        from depthtrack.evaluation.compare.comparison import Comparison
        from depthtrack.evaluation.compare.specs import read_specs

        return Comparison(
            sources=tuple(map(self.recordings.source, self.sequences)),
            specs=tuple(read_specs(self.trackers)),
            repeats=self.repeats,
            seed=self.seed,
            equal_ms=self.equal_time,
        )
