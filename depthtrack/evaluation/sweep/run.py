"""Run the cells of a sweep that have no row in its journal."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from time import perf_counter
from typing import Protocol

from depthtrack.errors import DepthtrackError
from depthtrack.evaluation.sweep.rows import Cell, Journal, Row

Measure = Callable[[Cell], Row]
"""Measures one cell and returns the measured values. A module-level function, so that other processes can import it."""


class SweepError(DepthtrackError):
    """A cell could not be measured; the message contains the reason."""


class Workers(Protocol):
    """Processes that measure cells."""

    def measure(self, function: Measure, cells: Sequence[Cell]) -> Iterator[tuple[int, Row]]:
        """Yield the number and result of each cell once, in any order, even if single workers die.

        Raises:
            SweepError: if a cell fails, or no worker survives.
        """
        ...


def run_sweep(
    measure: Measure,
    cells: Sequence[Cell],
    journal: Journal,
    workers: Workers,
    progress: Callable[[Iterator[Row]], Iterable[Row]] = iter,
) -> list[Row]:
    """Return the rows of all cells in order; measure and store those missing in the journal.

    progress: wraps the new rows, as a progress bar does.

    Each row contains `seconds`, the time of its cell.
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
    """Return the measured values of a cell and the `seconds` that they took.

    Raises:
        SweepError: if the measurement fails; unlike other errors, it can be pickled.
    """
    begun = perf_counter()
    try:
        row = measure(cell)
    except DepthtrackError as error:
        raise SweepError(str(error)) from None
    return row | {"seconds": round(perf_counter() - begun, 3)}
