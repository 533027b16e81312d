"""Running the cells of a sweep that have no row yet, wherever the workers are."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from time import perf_counter
from typing import Protocol

from depthtrack.errors import DepthtrackError
from depthtrack.evaluation.sweep.rows import Cell, Journal, Row

Measure = Callable[[Cell], Row]
"""Measures one cell; a module-level function, so that other processes can find it. The row leaves out the cell."""


class SweepError(DepthtrackError):
    """A cell could not be measured; the message says why."""


class Workers(Protocol):
    """Where cells are measured."""

    def measure(self, function: Measure, cells: Sequence[Cell]) -> Iterator[tuple[int, Row]]:
        """Numbers of cells and their results, as they come, in any order; every cell once, whatever becomes of
        single workers. Raises SweepError where a cell fails, or no worker survives."""
        ...


def run_sweep(
    measure: Measure,
    cells: Sequence[Cell],
    journal: Journal,
    workers: Workers,
    progress: Callable[[Iterator[Row]], Iterable[Row]] = iter,
) -> list[Row]:
    """Rows of all cells, in their order: those of the journal, and those measured now, which it receives as they come.

    `progress` may watch the new rows go by. Each has `seconds`, what the cell took.
    """
    missing = [cell for cell in cells if journal.get(cell) is None]
    for row in progress(_measured(measure, missing, workers)):
        journal.append(row)
    rows = [journal.get(cell) for cell in cells]
    return [row for row in rows if row is not None]


def _measured(measure: Measure, cells: Sequence[Cell], workers: Workers) -> Iterator[Row]:
    for number, result in workers.measure(measure, cells):
        yield cells[number] | result


def timed(measure: Measure, cell: Cell) -> Row:
    """What `measure` gives, and the `seconds` it took. Raises SweepError, which any process can pass on."""
    begun = perf_counter()
    try:
        row = measure(cell)
    except DepthtrackError as error:
        raise SweepError(str(error)) from None
    return row | {"seconds": round(perf_counter() - begun, 3)}
