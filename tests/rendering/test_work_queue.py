"""Each ticket is taken by one thread, and no worker that fails or polls makes a batch wait."""

import threading
import time
from collections.abc import Callable

import numba
import numpy as np
import pytest
from numpy.typing import NDArray

from depthtrack.rendering.raster.work_queue.queue import complete, dismiss, is_complete, new_tickets, pop, submit
from depthtrack.rendering.raster.work_queue.workers import Worker, Workers, spin_limit

LONG = 2**60
"""A spin limit that is never reached."""


@numba.njit(nogil=True)
def _count(tickets: NDArray[np.int64], thread: int, spin_limit: int, counts: NDArray[np.int64]) -> None:
    """Count the tickets of a thread in `counts` (threads, poses)."""
    while True:
        n = pop(tickets, thread, spin_limit)
        if n < 0:
            break
        counts[thread, n] += 1
        complete(tickets, thread)


@numba.njit
def _take(tickets: NDArray[np.int64], thread: int) -> int:
    """Return a ticket that is not counted as scored."""
    return pop(tickets, thread, 1)


def wait_for(condition: Callable[[], bool]) -> None:
    """Wait until another thread fulfils a condition; the long limit allows for a busy machine."""
    end = time.monotonic() + 120
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.001)


@pytest.mark.parametrize("threads", [1, 2, 4])
def test_each_ticket_is_taken_once_batch_after_batch(threads: int) -> None:
    """Batches of all sizes follow each other in any order while the other threads poll."""
    tickets, counts = new_tickets(threads), np.zeros((threads, 300), np.int64)
    _count(tickets, 0, 1, counts)  # compiled before the threads start
    others = [threading.Thread(target=_count, args=(tickets, n, LONG, counts), daemon=True) for n in range(1, threads)]
    for thread in others:
        thread.start()
    rng = np.random.default_rng(threads)
    for size in [0, 1, 300, 2, *rng.integers(0, 300, 2000)]:
        counts[:] = 0
        submit(tickets, size)
        while not is_complete(tickets):
            _count(tickets, 0, 1000, counts)
        np.testing.assert_array_equal(counts.sum(axis=0), np.arange(300) < size)
    dismiss(tickets, True)
    for thread in others:
        thread.join(120)
        assert not thread.is_alive()


def test_batch_numbers_may_overflow() -> None:
    tickets, counts = new_tickets(1), np.zeros((1, 3), np.int64)
    tickets[:16] = (2**31 - 2) << 32
    for done in range(1, 5):
        submit(tickets, 3)
        _count(tickets, 0, 1, counts)
        np.testing.assert_array_equal(counts, done)
        assert is_complete(tickets)


def test_a_thread_without_tickets_stops_at_its_spin_limit() -> None:
    tickets, counts = new_tickets(2), np.zeros((2, 1), np.int64)
    _count(tickets, 1, 1000, counts)
    assert counts.sum() == 0


def test_a_dismissed_thread_stops_after_the_last_ticket() -> None:
    tickets, counts = new_tickets(2), np.zeros((2, 3), np.int64)
    submit(tickets, 3)
    dismiss(tickets, True)
    _count(tickets, 1, LONG, counts)
    np.testing.assert_array_equal(counts[1], 1)
    assert is_complete(tickets)


def test_the_spin_limit_is_a_number_of_polls() -> None:
    assert spin_limit(1e-9) >= 1
    assert spin_limit(1.0) > 1000


def test_a_worker_works_after_each_request_and_ends_when_stopped() -> None:
    calls: list[int] = []
    worker = Worker(lambda: calls.append(1))
    assert worker.is_idle
    for n in range(1, 4):
        worker.request()
        wait_for(lambda: worker.is_idle)
        assert len(calls) == n
    worker.stop()
    worker.join()
    assert len(calls) == 3


def test_a_request_during_the_work_causes_another_call() -> None:
    begun, proceed, calls = threading.Semaphore(0), threading.Semaphore(0), []

    def work() -> None:
        begun.release()
        proceed.acquire()
        calls.append(1)

    worker = Worker(work)
    worker.request()
    begun.acquire()
    worker.request()
    proceed.release(2)
    wait_for(lambda: worker.is_idle)
    assert len(calls) == 2
    worker.stop()
    worker.join()


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_worker_that_fails_counts_as_idle() -> None:
    worker = Worker(lambda: 1 / 0)  # type: ignore[arg-type]
    worker.request()
    wait_for(lambda: worker.is_idle)
    worker.request()
    assert worker.is_idle
    worker.stop()
    worker.join()


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_ticket_of_a_worker_that_fails_raises_and_the_next_batch_completes() -> None:
    tickets, counts, taken = new_tickets(2), np.zeros((2, 5), np.int64), threading.Event()

    def work(thread: int, spin_limit: int) -> None:
        if thread > 0:
            _take(tickets, thread)
            taken.set()
            raise ValueError("of the test")
        assert taken.wait(120)
        _count(tickets, thread, spin_limit, counts)

    workers = Workers(tickets, 2, work)
    with pytest.raises(RuntimeError, match="failed"):
        workers.run(5, wake=True)
    assert counts.sum() == 4
    workers.finish_batch()
    counts[:] = 0
    workers.run(5, wake=True)
    np.testing.assert_array_equal(counts[0], 1)
    workers.stop()
    workers.join()


def test_a_batch_completes_after_an_exception_in_the_calling_thread() -> None:
    tickets, counts, fails = new_tickets(2), np.zeros((2, 200), np.int64), [True]

    def work(thread: int, spin_limit: int) -> None:
        if thread == 0 and fails:
            fails.clear()
            raise KeyboardInterrupt
        _count(tickets, thread, spin_limit, counts)

    workers = Workers(tickets, 2, work)
    with pytest.raises(KeyboardInterrupt):
        workers.run(200, wake=True)
    workers.finish_batch()
    counts[:] = 0
    workers.run(200, wake=True)
    np.testing.assert_array_equal(counts.sum(axis=0), 1)
    workers.stop()
    workers.join()
    workers.run(3, wake=True)
    assert is_complete(tickets)
