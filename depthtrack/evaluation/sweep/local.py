"""Workers on this machine: processes of joblib."""

from collections.abc import Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool

from joblib import Parallel, delayed, parallel_config

from depthtrack.evaluation.sweep.rows import Cell, Row
from depthtrack.evaluation.sweep.run import Measure, SweepError, timed

MOST_DEATHS = 3
"""Number of consecutive deaths of workers without a result between them at which the sweep stops."""


class LocalWorkers:
    """Processes of one thread each.

    jobs: number of processes.
    """

    def __init__(self, jobs: int) -> None:
        self.jobs = jobs

    def measure(self, function: Measure, cells: Sequence[Cell]) -> Iterator[tuple[int, Row]]:
        """Yield numbers and results of the cells; see `Workers`.

        If a worker is killed, new workers measure the cells without a result.

        Raises:
            SweepError: if a cell fails, or workers are killed repeatedly.
        """
        left, deaths = dict(enumerate(cells)), 0
        while left:
            try:
                for number, row in self._round(function, dict(left)):
                    del left[number]
                    deaths = 0
                    yield number, row
            except BrokenProcessPool as error:
                deaths += 1
                if deaths == MOST_DEATHS:
                    raise SweepError(
                        f"workers were killed {MOST_DEATHS} times in a row: check the memory, or use fewer --jobs"
                    ) from error

    def _round(self, function: Measure, cells: dict[int, Cell]) -> Iterator[tuple[int, Row]]:
        with parallel_config("loky", n_jobs=self.jobs, inner_max_num_threads=1):
            pool = Parallel(batch_size=1, return_as="generator_unordered")
            yield from pool(delayed(_numbered)(function, number, cell) for number, cell in cells.items())


def _numbered(function: Measure, number: int, cell: Cell) -> tuple[int, Row]:
    return number, timed(function, cell)
