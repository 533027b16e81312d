"""Workers for the tests of sweeps."""

from collections.abc import Iterator, Sequence

from depthtrack.evaluation.sweep.rows import Cell, Row
from depthtrack.evaluation.sweep.run import Measure, timed


class InThisProcess:
    """Measure one cell after the other in the process of the test."""

    def measure(self, function: Measure, cells: Sequence[Cell]) -> Iterator[tuple[int, Row]]:
        for number, cell in enumerate(cells):
            yield number, timed(function, cell)
