"""`depthtrack reproduce`: the papers' experiments, our figures beside theirs."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from depthtrack.cli.progress import bar
from depthtrack.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from depthtrack.benchmarks.papers.reproduce import Reproduction


@dataclass(frozen=True)
class Command:
    """Repeat the experiments of a paper: a table, a picture, our figures beside the paper's, and the time it took.

    Every figure gets a folder under DIR: rows.jsonl with a row a measurement, table.csv, summary.json, figure.png.
    Rows are written as they come; the same command goes on where an interrupted one stood. After a change of the
    code, choose a new DIR.
    """

    figures: Annotated[tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="FIGURE ...")]
    """Figures by name, as schroeder-8 or fig8; all of a paper by its author, as schroeder; all; or list, which tells
    what there is."""
    out: Annotated[Path | None, tyro.conf.arg(aliases=("-o",), metavar="DIR")] = None
    """Folder to write to."""
    quick: bool = False
    """A coarse version: fewer cells and repetitions, swarms at 96 pixels; two minutes a figure on two cores, less than
    one for those of schroeder."""
    variant: Literal["default", "paper"] = "default"
    """The trackers as we measured them best, or as their papers have them."""
    renderer: Literal["raster", "egl", "osmesa"] = "raster"
    """What renders and scores the swarm's hypotheses."""
    repetitions: Annotated[int | None, tyro.conf.arg(metavar="N")] = None
    """Times every measurement of the swarm is repeated with another seed; unless given, as often as in the paper."""
    resolution: Annotated[int | None, tyro.conf.arg(metavar="PIXELS")] = None
    """Longest side of the region that the swarm's hypotheses are rendered at; the sensor's own unless given."""
    frames: Annotated[int | None, tyro.conf.arg(metavar="N")] = None
    """Only the first so many frames of the motion."""
    synergies: Annotated[str | None, tyro.conf.arg(metavar="NAME|PATH")] = None
    """In place of each figure's own synergies: a set by name, as leap; those of a motion's own postures, as signs; a
    .json of `depthtrack synergies fit`; or recorded postures, which fig7 then approximates."""
    jobs: Annotated[int | None, tyro.conf.arg(metavar="N")] = None
    """Processes on this machine; as many as there are cores unless given."""
    scheduler: Annotated[str | None, tyro.conf.arg(metavar="ADDRESS")] = None
    """A Dask scheduler, as tcp://127.0.0.1:8786, whose workers measure instead (extra: sweep)."""
    json: bool = False
    """Print the summaries as JSON, one array."""

    def run(self) -> None:
        from json import dumps

        from depthtrack.benchmarks.papers.experiment import ExperimentOptions
        from depthtrack.benchmarks.papers.registry import chosen_experiments
        from depthtrack.benchmarks.papers.reproduce import reproduce
        from depthtrack.cli.output_folder import check_output_folder
        from depthtrack.evaluation.sweep.workers import chosen_workers

        names = [name for name in self.figures if name != "list"]
        experiments = chosen_experiments(names or ["all"])
        options = ExperimentOptions(
            self.quick, self.variant, self.renderer, self.repetitions, self.resolution, self.frames, self.synergies
        )
        if "list" in self.figures:
            for experiment in experiments:
                print(f"{experiment.name:15} {len(experiment.cells(options)):4} cells  {experiment.title}")
            return
        if self.out is None or not self.figures:
            raise InputError("name the figures and a folder to write to, as in  depthtrack reproduce all -o DIR")
        check_output_folder(self.out)
        workers, done = chosen_workers(self.jobs, self.scheduler), []
        for experiment in experiments:
            folder = self.out / experiment.name
            done.append(reproduce(experiment, options, folder, workers, _bar(experiment.name)))
            if not self.json:
                print(_as_text(done[-1], folder))
        if self.json:
            print(dumps([each.to_json() for each in done], indent=2))


def _bar(name: str) -> "Callable[[Iterator[dict[str, object]], int, int], Iterable[dict[str, object]]]":
    return lambda rows, total, reused: bar(rows, "cell", total, name, reused)


def _as_text(done: "Reproduction", folder: Path) -> str:
    from depthtrack.text_table import aligned

    lines = [("", "paper, in its text", "ours"), *((c.what, c.paper, c.ours_text) for c in done.comparisons)]
    reused = f"{done.reused} of them from before, " if done.reused else ""
    time = f"{done.seconds:.0f} s ({done.cell_seconds:.0f} s in the workers together)"
    return "\n".join(
        [
            f"{done.figure}: {done.title} ({done.source})",
            *(f"  {line}" for line in aligned(lines, left=2)),
            f"  {done.cells} cells, {reused}{time}: {folder}",
            "",
        ]
    )
