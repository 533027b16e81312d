"""Workers on an existing Dask cluster."""

from collections.abc import Iterator, Sequence
from concurrent.futures import CancelledError
from importlib import import_module
from typing import Any

from depthtrack.errors import InputError, MissingExtraError
from depthtrack.evaluation.sweep.rows import Cell, Row
from depthtrack.evaluation.sweep.run import Measure, SweepError, timed

PATIENCE = 20
"""Seconds to wait for a scheduler's answer, and for its first worker."""


class DaskWorkers:
    """The workers of a scheduler at an address such as tcp://host:8786; they need depthtrack installed.

    Raises MissingExtraError without Dask. The scheduler gives a killed worker's cells to others.
    """

    def __init__(self, address: str) -> None:
        try:
            self._dask: Any = import_module("distributed")
        except ImportError as error:
            raise MissingExtraError("a sweep on a Dask cluster", "sweep") from error
        self.address = address

    def measure(self, function: Measure, cells: Sequence[Cell]) -> Iterator[tuple[int, Row]]:
        """See `Workers`. Raises InputError where no scheduler answers, or it has no workers."""
        if not cells:
            return
        with self._connect() as client:
            number_of = {client.submit(timed, function, cell, pure=False): number for number, cell in enumerate(cells)}
            for future in self._dask.as_completed(list(number_of), loop=client.loop):
                yield number_of.pop(future), self._result(future)
                # What is written down needs no place in the cluster's memory.
                future.release()

    def _connect(self) -> Any:
        try:
            client = self._dask.Client(self.address, timeout=PATIENCE, set_as_default=False)
        except (OSError, ValueError, TimeoutError) as error:
            raise InputError(
                f"no Dask scheduler answers at '{self.address}' (as in tcp://127.0.0.1:8786): {error}"
            ) from error
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError as error:
            client.close()
            raise InputError(
                f"the Dask scheduler at {self.address} has no workers: start some with  dask worker {self.address}"
            ) from error
        return client

    def _result(self, future: Any) -> Row:
        try:
            row: Row = future.result()
        except ModuleNotFoundError as error:
            raise SweepError(f"a Dask worker cannot import depthtrack: install it there as here ({error})") from error
        except self._dask.scheduler.KilledWorker as error:
            raise SweepError(f"a cell killed every worker that took it: is memory short there? ({error})") from error
        except (CancelledError, self._dask.comm.core.CommClosedError) as error:
            raise SweepError(f"the Dask scheduler at {self.address} went away: run the same command again") from error
        return row
