"""`depthtrack markers compare-filling`: compare filling methods on cut stretches."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast, get_args

import tyro

from depthtrack.cli.stated_default import number, stated_default
from depthtrack.errors import InputError
from depthtrack.ranges import MOST_SEED

if TYPE_CHECKING:
    from depthtrack.evaluation.gap_comparison import FillScore


@dataclass(frozen=True)
class FoldersArgument:
    """Folders of labelled markers."""

    paths: Annotated[tuple[Path, ...], tyro.conf.Positional, stated_default(name="folders", metavar="FOLDER ...")]
    """Folders that `markers label` or `markers solve` wrote."""


@dataclass(frozen=True)
class Command:
    """Cut stretches out of visible markers, and compare how each method fills them.

    One marker at a time is cut, or several neighbours with --together, and all poses are fitted again without what was
    cut.
    """

    labelled: tyro.conf.OmitArgPrefixes[FoldersArgument]
    frames: Annotated[tuple[int, int], number(1, 10**7, metavar="FRAMES FRAMES")] = (100, 200)
    """Shortest and longest stretch."""
    seeds: Annotated[tuple[int, ...], number(0, MOST_SEED, metavar="SEED ...")] = (1000, 1001, 1002)
    """Seeds of the places; each cuts the whole capture once."""
    together: Annotated[int, number(1, 1000)] = 1
    """Neighbouring markers that lose overlapping stretches, as where something hides a finger."""
    methods: Annotated[tuple[str, ...], stated_default(metavar="METHOD ...")] = (
        "smooth",
        "paper",
        "spline",
        "pattern",
        "pca",
    )
    """Methods to compare: smooth, paper, spline, pattern, pca."""
    json: bool = False
    """Print figures as JSON instead of a table."""

    def run(self) -> None:
        from depthtrack.cli.progress import percent_bar
        from depthtrack.evaluation.gap_comparison import compare_filling
        from depthtrack.markers.filling.options import FillMethod
        from depthtrack.markers.folder.reading import MarkerFolder
        from depthtrack.options import check_seed
        from depthtrack.strict_data import json_text

        unknown = [method for method in self.methods if method not in get_args(FillMethod)]
        if unknown:
            raise InputError(f"there is no method '{unknown[0][:40]}': choose among {', '.join(get_args(FillMethod))}")
        if not self.labelled.paths or not self.methods or not self.seeds:
            raise InputError("a comparison needs a folder, a method and a seed at least")
        for seed in self.seeds:
            check_seed(seed)
        captures = [MarkerFolder.load(path).labelled for path in self.labelled.paths]
        methods = cast("tuple[FillMethod, ...]", self.methods)
        with percent_bar() as show:
            scores = compare_filling(captures, *self.frames, self.seeds, methods, self.together, show)
        if self.json:
            print(json_text([score.row() for score in scores], indent=2))
        else:
            self._print(scores)

    def _print(self, scores: "list[FillScore]") -> None:
        count = "1 marker" if self.together == 1 else f"{self.together} neighbours"
        print(f"stretches of {self.frames[0]} to {self.frames[1]} frames, {count} at a time")
        print(f"  {'method':9}{'markers':12}{'samples':>9}{'filled':>9}{'median':>11}{'rms':>11}{'expected':>11}")
        for score in scores:
            row = score.row()
            figures = "".join(
                f"{'-' if row[name] is None else f'{row[name]:.2f} mm':>11}"
                for name in ("median_mm", "rms_mm", "expected_mm")
            )
            print(f"  {score.method:9}{score.where:12}{score.samples:>9}{100 * score.filled:>7.1f} %{figures}")
