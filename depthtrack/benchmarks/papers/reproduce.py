"""Run an experiment and write its folder.

The folder contains `rows.jsonl` with one row per cell, from which an interrupted sweep continues, `table.csv`,
`summary.json` and `figure.png`.
"""

import csv
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
from depthtrack.outputs import locked
from depthtrack.strict_data import json_text

RowProgress = Callable[[Iterator[Row], int, int], Iterable[Row]]
"""Wraps the new rows, as a progress bar does. Takes the rows, the number of all rows, and that of existing rows."""


@dataclass(frozen=True)
class Reproduction:
    """Summary of a reproduced figure.

    machine: machine of this process; workers of a cluster may run on others.
    cells: number of cells.
    reused: number of cells with existing rows.
    seconds: time of this call.
    cell_seconds: total time of all cells, existing ones included.
    comparisons: figures of the paper beside ours.
    table: table of the experiment.
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
        """Return the summary as JSON values."""
        return asdict(self)


def reproduce(
    experiment: Experiment,
    options: ExperimentOptions,
    folder: Path,
    workers: Workers,
    progress: RowProgress = lambda rows, total, reused: rows,
) -> Reproduction:
    """Measure the cells without a row in `folder`, then write table, picture and summary.

    progress: wraps the new rows.

    Raises:
        InputError: if an option is unusable, or `rows.jsonl` is damaged.
        SweepError: if a cell fails.
    """
    begun = perf_counter()
    machine = describe_machine()
    cells = [full_cell(experiment, cell) for cell in experiment.cells(options)]
    folder.mkdir(parents=True, exist_ok=True)
    with locked(folder), Journal(folder / "rows.jsonl", list(cells[0])) as journal:
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
    write_atomic(folder / "summary.json", json_text(done.to_json(), indent=2).encode() + b"\n")
    return done


def as_note(done: Reproduction, cell: Cell) -> str:
    """Return one line that describes the measurements.

    cell: any cell, whose keys show the options that the experiment uses.
    """
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
    """Return the table as CSV with a header line."""
    text = StringIO()
    writer = csv.DictWriter(text, list(table[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(table)
    return text.getvalue()
