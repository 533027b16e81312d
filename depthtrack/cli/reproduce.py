"""`depthtrack reproduce`: repeat experiments of the papers."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from depthtrack.cli.argument_checks import OUTPUT_FOLDER
from depthtrack.cli.progress import bar
from depthtrack.cli.stated_default import number, stated_default
from depthtrack.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from depthtrack.benchmarks.papers.reproduce import Reproduction


@dataclass(frozen=True)
class Command:
    """Repeat the experiments of a paper and print both figures and the time.

    Each figure gets a folder in DIR with rows.jsonl (one row per measurement), table.csv, summary.json and figure.png.
    The same command continues an interrupted one. After a change of the code, choose a new DIR.
    """

    figures: Annotated[tuple[str, ...], tyro.conf.Positional, stated_default(metavar="FIGURE ...")]
    """Figures by name, as schroeder-8 or fig8; an author, as schroeder, for a whole paper; all; `crossmodel` for hands
    that the trackers do not know; or `list` to print the names."""
    out: Annotated[Path | None, OUTPUT_FOLDER, stated_default(aliases=("-o",), metavar="DIR")] = None
    """Folder to write to."""
    quick: bool = False
    """Run a coarse version with fewer cells and repetitions and swarms at 96 pixels. A figure then takes two minutes on
    two cores, less than one for those of schroeder."""
    variant: Literal["default", "paper"] = "default"
    """Trackers of this program, or those of the papers."""
    renderer: Literal["raster", "egl", "osmesa"] = "raster"
    """Renderer of the swarm's hypotheses."""
    repetitions: Annotated[int | None, number(1, 10000, metavar="N")] = None
    """Measurements of the swarm per cell, each with another seed (default: as many as in the paper)."""
    first_seed: Annotated[int, number(0, 10000, metavar="N")] = 0
    """Seed of the first of them. `crossmodel` counts from the first one of its split."""
    resolution: Annotated[int | None, number(1, 10000, metavar="PIXELS")] = None
    """Longest side of the rendered hypotheses of the swarm (default: the resolution of the sensor)."""
    frames: Annotated[int | None, number(1, 10**7, metavar="N")] = None
    """Use only the first N frames of the motion."""
    synergies: Annotated[str | None, stated_default(metavar="NAME|PATH")] = None
    """Synergies in place of those of each figure: the name of a set, as leap, or of a motion, as signs; a .json from
    `depthtrack synergies fit`; or recorded postures, which fig7 then approximates."""
    rig: Annotated[tuple[Path, ...], stated_default(metavar="RIG.glb ...")] = ()
    """Rigged meshes for `crossmodel` (default: hands drawn from the prior of sizes)."""
    split: Literal["tuning", "report"] = "report"
    """Seeds of `crossmodel`: those that thresholds are tuned on, or those of reported figures."""
    jobs: Annotated[int | None, number(1, 1024, metavar="N")] = None
    """Processes on this machine (default: one per core)."""
    scheduler: Annotated[str | None, stated_default(metavar="ADDRESS")] = None
    """Address of a Dask scheduler, as tcp://127.0.0.1:8786, whose workers measure instead (extra: sweep)."""
    json: bool = False
    """Print the summaries as a JSON array."""

    def run(self) -> None:
        from depthtrack.benchmarks.papers.experiment import ExperimentOptions
        from depthtrack.benchmarks.papers.registry import chosen_experiments
        from depthtrack.benchmarks.papers.reproduce import reproduce
        from depthtrack.evaluation.sweep.workers import chosen_workers
        from depthtrack.strict_data import json_text

        names = [name for name in self.figures if name != "list"]
        experiments = chosen_experiments(names or ["all"])
        options = ExperimentOptions(
            quick=self.quick,
            variant=self.variant,
            renderer=self.renderer,
            repetitions=self.repetitions,
            first_seed=self.first_seed,
            resolution=self.resolution,
            frames=self.frames,
            synergies=self.synergies,
            rigs=tuple(map(str, self.rig)),
            split=self.split,
        )
        if "list" in self.figures:
            for experiment in experiments:
                print(f"{experiment.name:15} {len(experiment.cells(options)):4} cells  {experiment.title}")
            return
        if self.out is None or not self.figures:
            raise InputError("expected figures and a folder to write to: use  depthtrack reproduce all -o DIR")
        workers, done = chosen_workers(self.jobs, self.scheduler), []
        for experiment in experiments:
            folder = self.out / experiment.name
            done.append(reproduce(experiment, options, folder, workers, _bar(experiment.name)))
            if not self.json:
                print(_as_text(done[-1], experiment.reference, folder))
        if self.json:
            print(json_text([each.to_json() for each in done], indent=2))


def _bar(name: str) -> "Callable[[Iterator[dict[str, object]], int, int], Iterable[dict[str, object]]]":
    return lambda rows, total, reused: bar(rows, "cell", total, name, reused)


def _as_text(done: "Reproduction", reference: str, folder: Path) -> str:
    from depthtrack.text_table import aligned

    lines = [("", reference, "ours"), *((c.what, c.paper, c.ours_text) for c in done.comparisons)]
    reused = f"{done.reused} of them reused, " if done.reused else ""
    time = f"{done.seconds:.0f} s ({done.cell_seconds:.0f} s in all workers)"
    return "\n".join(
        [
            f"{done.figure}: {done.title} ({done.source})",
            *(f"  {line}" for line in aligned(lines, left=2)),
            f"  {done.cells} cells, {reused}{time}: {folder}",
            "",
        ]
    )
