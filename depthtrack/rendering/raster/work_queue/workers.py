"""Threads that score the tickets of a batch together with the calling thread."""

import threading
import time
from collections.abc import Callable
from functools import cache, partial

from depthtrack.rendering.raster.work_queue.queue import Tickets, dismiss, is_complete, new_tickets, pop, submit

_SPIN_TIME = 2e-4
"""Time, s, that a worker polls for the next batch. A swarm of 64 takes up to 0.13 ms between two generations."""
_OWN_POLLS = 1000
"""Polls, 15 us or more, of the calling thread for the last poses of a batch before it yields its core."""


@cache
def spin_limit(seconds: float) -> int:
    """Return the number of polls that take about `seconds` s.

    It is measured, since the pause instruction takes from 10 to 140 cycles, depending on the processor.
    """
    tickets, polls, shortest = new_tickets(2), 2000, float("inf")
    for _ in range(5):
        start = time.perf_counter()
        pop(tickets, 1, polls)
        shortest = min(shortest, time.perf_counter() - start)
    return max(1, int(polls * seconds / shortest))


class Worker:
    """Daemon thread that calls `work` after a request, once or several times."""

    def __init__(self, work: Callable[[], None]) -> None:
        self._work = work
        # Only the caller writes `_requested`, and only the thread writes `_finished`: no update is lost.
        self._requested = self._finished = 0
        self._is_stopped = False
        self._wake = threading.Lock()
        self._wake.acquire()
        self._thread = threading.Thread(target=self._run, daemon=True, name="depthtrack-raster")
        self._thread.start()

    @property
    def is_idle(self) -> bool:
        """Whether `work` has returned, and is not called again before the next request."""
        return self._finished == self._requested or not self._thread.is_alive()

    def request(self) -> None:
        """Request a call of `work`; if it runs already, it is called once more afterwards."""
        self._requested += 1
        if self._wake.locked():
            self._wake.release()

    def stop(self) -> None:
        """End the thread once `work` has returned, without a wait."""
        self._is_stopped = True
        self.request()

    def join(self) -> None:
        """Wait until the thread has ended."""
        self._thread.join()

    def _run(self) -> None:
        while not self._is_stopped:
            self._wake.acquire()
            while self._finished != self._requested and not self._is_stopped:
                requested = self._requested
                self._work()
                self._finished = requested


class Workers:
    """Workers that share batches with the calling thread.

    They start with the first batch that wakes them.

    tickets: for all threads.
    threads: number of threads, the calling one included.
    work: scores poses in a thread until `queue.pop` returns -1; takes the thread's number and spin limit.
    """

    def __init__(self, tickets: Tickets, threads: int, work: Callable[[int, int], None]) -> None:
        self._tickets, self._threads, self._work = tickets, threads, work
        self._workers: list[Worker] = []
        self._is_stopped = False

    def run(self, count: int, wake: bool) -> None:
        """Score a batch of `count` poses; no thread may hold a ticket, see `finish_batch`.

        wake: wake the idle workers. Workers that still poll take tickets in any case.

        Raises:
            RuntimeError: if a worker failed while it held a ticket.
        """
        if wake and not self._is_stopped:
            for thread in range(len(self._workers) + 1, self._threads):
                self._workers.append(Worker(partial(self._work, thread, spin_limit(_SPIN_TIME))))
        submit(self._tickets, count)
        if wake:
            for worker in self._workers:
                worker.request()
        self._work(0, _OWN_POLLS)
        while not is_complete(self._tickets):
            if self._are_idle() and not is_complete(self._tickets):
                raise RuntimeError("a thread of the rasteriser failed, see its error above")
            time.sleep(0)

    def finish_batch(self) -> None:
        """Wait until no worker holds a ticket; only a batch that raised an exception leaves any."""
        if not is_complete(self._tickets):
            self.wait_until_idle()

    def wait_until_idle(self) -> None:
        """Wait until no worker uses the arrays of `work`, so that they can be replaced."""
        dismiss(self._tickets, True)
        while not self._are_idle():
            time.sleep(0)
        dismiss(self._tickets, False)

    def stop(self) -> None:
        """End the threads without a wait; later batches run in the calling thread alone."""
        self._is_stopped = True
        dismiss(self._tickets, True)
        for worker in self._workers:
            worker.stop()

    def join(self) -> None:
        """Wait until the threads have ended."""
        for worker in self._workers:
            worker.join()

    def _are_idle(self) -> bool:
        return all(worker.is_idle for worker in self._workers)
