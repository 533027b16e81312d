"""One experiment from its cells to its folder: rows, table, picture, and our figures beside the paper's.

The folder holds `rows.jsonl` (a row a cell, written as they come; what an interrupted sweep goes on from),
`table.csv`, `summary.json` and `figure.png`.
"""

import csv
import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from io import StringIO
from pathlib import Path
from time import perf_counter
from typing import Any

from depthtrack.benchmarks.papers.experiment import Experiment, ExperimentOptions, PaperComparison
from depthtrack.benchmarks.papers.plot import draw_png
from depthtrack.benchmarks.papers.registry import full_cell, measure_cell
from depthtrack.evaluation.sweep.rows import Cell, Journal, Row
from depthtrack.evaluation.sweep.run import Workers, run_sweep
from depthtrack.files import write_atomic
from depthtrack.machine import Machine, describe_machine

RowProgress = Callable[[Iterator[Row], int, int], Iterable[Row]]
"""Watches new rows go by; told how many there are in all, and how many were there before."""


@dataclass(frozen=True)
class Reproduction:
    """A figure, reproduced.

    `cells` in all, `reused` of which the folder had rows already; `seconds` that this call took, `cell_seconds` that
    all cells together took, now or before; `table` as the experiment tabulates its rows; `machine` that called (a
    cluster's workers may be others).
    """

    figure: str
    title: str
    source: str
    options: ExperimentOptions
    machine: Machine
    cells: int
    reused: int
    seconds: float
    cell_seconds: float
    comparisons: list[PaperComparison]
    table: list[Row]

    def to_json(self) -> dict[str, Any]:
        return asdict(self)


def reproduce(
    experiment: Experiment,
    options: ExperimentOptions,
    folder: Path,
    workers: Workers,
    progress: RowProgress = lambda rows, total, reused: rows,
) -> Reproduction:
    """Measure the cells that `folder` has no row of yet, then write table, picture and summary there."""
    begun = perf_counter()
    machine = describe_machine()
    cells = [full_cell(experiment, cell) for cell in experiment.cells(options)]
    with Journal(folder / "rows.jsonl", list(cells[0])) as journal:
        reused = sum(journal.get(cell) is not None for cell in cells)
        rows = run_sweep(measure_cell, cells, journal, workers, lambda rows: progress(rows, len(cells), reused))
    done = Reproduction(
        figure=experiment.name,
        title=experiment.title,
        source=experiment.source,
        options=options,
        machine=machine,
        cells=len(cells),
        reused=reused,
        seconds=round(perf_counter() - begun, 3),
        cell_seconds=round(sum(row["seconds"] for row in rows), 3),
        comparisons=experiment.compare(rows),
        table=experiment.tabulate(rows),
    )
    write_atomic(folder / "table.csv", as_csv(done.table).encode())
    write_atomic(folder / "figure.png", draw_png(experiment, rows, done.comparisons, as_note(done, cells[0])))
    write_atomic(folder / "summary.json", json.dumps(done.to_json(), indent=2).encode() + b"\n")
    return done


def as_note(done: Reproduction, cell: Cell) -> str:
    """How the rows came to be, in one line; `cell`, any of them, tells what the experiment takes note of."""
    options = done.options
    side = "native resolution" if options.side is None else f"{options.side} pixels"
    parts = [
        f"variant {options.variant}" if "variant" in cell else "",
        f"{options.renderer}, {side}" if "renderer" in cell else "",
        f"{cell['frames']} frames" if cell.get("frames") else "",
        f"{done.cells} cells",
        f"{done.cell_seconds:,.0f} s in all workers",
        "--quick" if options.quick else "",
    ]
    return ", ".join(part for part in parts if part)


def as_csv(table: Sequence[Row]) -> str:
    """The table with a header line."""
    text = StringIO()
    writer = csv.DictWriter(text, list(table[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(table)
    return text.getvalue()
