"""Workers of an existing Dask cluster."""

import re
from collections.abc import Iterator, Sequence
from concurrent.futures import CancelledError
from importlib import import_module
from typing import Any

from depthtrack.errors import InputError, MissingExtraError
from depthtrack.evaluation.sweep.rows import Cell, Row
from depthtrack.evaluation.sweep.run import Measure, SweepError, timed

TIMEOUT = 20
"""Seconds to wait for the scheduler, and for its first worker."""
_ADDRESS = re.compile(r"(?:tcp://)?(?:\[[0-9a-fA-F:.]+\]|[\w.-]+):\d{1,5}")
"""Host and port; other schemes need keys or libraries that no option states."""


class DaskWorkers:
    """Workers of a Dask scheduler, with depthtrack installed.

    address: address of the scheduler, as tcp://host:8786.

    The scheduler reassigns the cells of a killed worker.

    Raises:
        InputError: if the address is none.
        MissingExtraError: if Dask is not installed.
    """

    def __init__(self, address: str) -> None:
        if not _ADDRESS.fullmatch(address):
            raise InputError(f"the Dask scheduler must have an address as tcp://127.0.0.1:8786, found '{address:.60}'")
        try:
            self._dask: Any = import_module("distributed")
        except ImportError as error:
            raise MissingExtraError("a sweep on a Dask cluster", "sweep") from error
        self.address = address

    def measure(self, function: Measure, cells: Sequence[Cell]) -> Iterator[tuple[int, Row]]:
        """Yield numbers and results of the cells; see `Workers`.

        Raises:
            InputError: if no scheduler answers, or it has no workers.
            SweepError: if a cell fails, or the scheduler closes.
        """
        if not cells:
            return
        with self._connect() as client:
            number_of = {client.submit(timed, function, cell, pure=False): number for number, cell in enumerate(cells)}
            for future in self._dask.as_completed(list(number_of), loop=client.loop):
                yield number_of.pop(future), self._result(future)
                # The cluster would keep the result in memory.
                future.release()

    def _connect(self) -> Any:
        try:
            client = self._dask.Client(self.address, timeout=TIMEOUT, set_as_default=False)
        except (OSError, ValueError, TimeoutError) as error:
            raise InputError(
                f"no Dask scheduler answers at '{self.address}': give an address as tcp://127.0.0.1:8786 ({error})"
            ) from error
        try:
            client.wait_for_workers(1, timeout=TIMEOUT)
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
            raise SweepError(f"a Dask worker cannot import depthtrack: install it on the worker ({error})") from error
        except self._dask.scheduler.KilledWorker as error:
            raise SweepError(f"a cell killed all its workers: check the memory of the cluster ({error})") from error
        except (CancelledError, self._dask.comm.core.CommClosedError) as error:
            raise SweepError(f"the Dask scheduler at {self.address} closed: run the same command again") from error
        return row
