"""Workers on this machine: one process a core, through joblib."""

from collections.abc import Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool

from joblib import Parallel, delayed, parallel_config

from depthtrack.evaluation.sweep.rows import Cell, Row
from depthtrack.evaluation.sweep.run import Measure, SweepError, timed

PATIENCE = 3
"""So often in a row may workers die before any of them has given a result."""


class LocalWorkers:
    """`jobs` processes of one thread each."""

    def __init__(self, jobs: int) -> None:
        self.jobs = jobs

    def measure(self, function: Measure, cells: Sequence[Cell]) -> Iterator[tuple[int, Row]]:
        """See `Workers`. When a worker is killed, what was not yet delivered is measured again by fresh ones."""
        left, deaths = dict(enumerate(cells)), 0
        while left:
            try:
                for number, row in self._round(function, dict(left)):
                    del left[number]
                    deaths = 0
                    yield number, row
            except BrokenProcessPool as error:
                deaths += 1
                if deaths == PATIENCE:
                    raise SweepError(
                        f"workers were killed {PATIENCE} times in a row: is memory short? try fewer --jobs"
                    ) from error

    def _round(self, function: Measure, cells: dict[int, Cell]) -> Iterator[tuple[int, Row]]:
        with parallel_config("loky", n_jobs=self.jobs, inner_max_num_threads=1):
            pool = Parallel(batch_size=1, return_as="generator_unordered")
            yield from pool(delayed(_numbered)(function, number, cell) for number, cell in cells.items())


def _numbered(function: Measure, number: int, cell: Cell) -> tuple[int, Row]:
    return number, timed(function, cell)
