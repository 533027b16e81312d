"""Threads that share batches: every ticket is taken once, nobody is left behind, and all of them end."""

import gc
import threading
import time
from collections.abc import Callable

import numba
import numpy as np
import pytest
from numpy.typing import NDArray

from depthtrack.hand.shape import HandShape
from depthtrack.rendering.raster import RasterScorer
from depthtrack.rendering.raster.work_queue.queue import done, is_done, new_tickets, pop, submit, tell_to_leave
from depthtrack.rendering.raster.work_queue.worker import Helper
from tests.support.rendering import random_poses, target_of, window_on


@numba.njit(nogil=True)
def _count(tickets: NDArray[np.int64], thread: int, spin_limit: int, counts: NDArray[np.int64]) -> None:
    """Note every ticket that this thread gets."""
    while True:
        n = pop(tickets, thread, spin_limit)
        if n < 0:
            break
        counts[thread, n] += 1
        done(tickets, thread)


@pytest.mark.parametrize("threads", [1, 2, 4])
def test_every_ticket_is_taken_once_batch_after_batch(threads: int) -> None:
    """Batches of all sizes, larger after smaller and the other way round, while threads linger between them."""
    tickets, counts = new_tickets(threads), np.zeros((threads, 300), np.int64)
    _count(tickets, 0, 1, counts)  # compiled before the race
    others = [threading.Thread(target=_count, args=(tickets, n, 2**60, counts)) for n in range(1, threads)]
    for thread in others:
        thread.start()
    rng = np.random.default_rng(threads)
    for size in [0, 1, 300, 2, *rng.integers(0, 300, 2000)]:
        counts[:] = 0
        submit(tickets, size)
        while not is_done(tickets):
            _count(tickets, 0, 1000, counts)
        np.testing.assert_array_equal(counts.sum(axis=0), np.arange(300) < size)
    tell_to_leave(tickets, True)
    for thread in others:
        thread.join(30)
        assert not thread.is_alive()


def test_who_finds_no_ticket_runs_out_of_patience() -> None:
    tickets, counts = new_tickets(2), np.zeros((2, 1), np.int64)
    _count(tickets, 1, 1000, counts)
    assert counts.sum() == 0


def test_a_helper_works_when_woken_and_ends_when_told() -> None:
    calls: list[int] = []
    called = threading.Event()

    def work() -> None:
        calls.append(1)
        called.set()

    helper = Helper(work)
    for n in range(1, 4):
        called.clear()
        helper.wake()
        assert called.wait(30)
        until(lambda: helper.is_idle)
        assert len(calls) == n
    helper.stop()
    assert not helper._thread.is_alive()


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_helper_that_fails_is_not_waited_for() -> None:
    helper = Helper(lambda: 1 / 0)  # type: ignore[arg-type]
    helper.wake()
    until(lambda: not helper._thread.is_alive())
    assert helper.is_idle
    helper.wake()
    helper.stop()


def test_batches_and_observations_of_any_size_follow_each_other() -> None:
    """Arrays are replaced while the other threads linger: they must let go of the old ones first."""
    rng = np.random.default_rng(2)
    shape, poses = HandShape(), random_poses(rng, 700, (0, 0, 0.5), 0.1)
    targets = [target_of(shape, poses[0], window_on(shape, poses[0], side), rng) for side in (40, 64)]
    with RasterScorer(shape) as one, RasterScorer(shape, threads=3) as many:
        for count in (3, 700, 1, 300, 65, 2):
            for target in targets:
                one.set_target(target)
                many.set_target(target)
                for _ in range(5):
                    np.testing.assert_array_equal(one.score(poses[:count]), many.score(poses[:count]))


def test_a_scorer_that_is_forgotten_ends_its_threads() -> None:
    before = threading.active_count()
    rng = np.random.default_rng(3)
    shape, poses = HandShape(), random_poses(rng, 64, (0, 0, 0.5), 0.1)
    scorer = RasterScorer(shape, threads=3)
    scorer.set_target(target_of(shape, poses[0], window_on(shape, poses[0], 64), rng))
    scorer.score(poses)
    assert threading.active_count() == before + 2
    del scorer
    gc.collect()
    until(lambda: threading.active_count() == before)


def until(condition: Callable[[], bool]) -> None:
    """Wait for what another thread brings about; fail when half a minute was not enough."""
    end = time.monotonic() + 30
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.001)
