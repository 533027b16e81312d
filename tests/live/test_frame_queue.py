"""Frames of a source that blocks are read in a thread; gates fix the order of events."""

import threading
from collections.abc import Iterator

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.live.frame_queue import queue_frames
from depthtrack.live.frames import LiveFrame
from depthtrack.live.late_frames import LateFrames

DEPTH = np.zeros((2, 2), np.float32)
LONGEST = 20.0
"""Seconds after which a test that waits in vain fails."""


def frame(number: int) -> LiveFrame:
    return LiveFrame(number, number / 30, DEPTH, None, 0.0)


@pytest.mark.parametrize(
    ("times", "last", "chosen"),
    [
        ([0.1], None, 0),
        ([0.1, 0.2, 0.3], None, 2),
        ([0.1, 0.2, 0.3], 0.0, 0),
        ([0.03, 0.06, 0.09, 0.12], 0.0, 2),
        ([0.5, 0.6], 0.0, 0),
        ([0.5, 1.2], 0.0, 1),
    ],
)
def test_the_choice_among_waiting_frames(times: list[float], last: float | None, chosen: int) -> None:
    assert LateFrames(longest_step=0.1, longest_delay=1.0).choose(times, last) == chosen


def test_frames_that_wait_are_dropped_with_small_gaps() -> None:
    taken, all_read = threading.Event(), threading.Event()

    def source() -> Iterator[LiveFrame]:
        yield frame(0)
        assert taken.wait(LONGEST)
        yield from map(frame, range(1, 11))
        all_read.set()

    numbers = []
    for each in queue_frames(source()):
        numbers.append(each.number)
        taken.set()
        assert all_read.wait(LONGEST)
    assert numbers == [0, 3, 6, 9, 10]


def test_old_frames_are_not_kept() -> None:
    taken, all_read = threading.Event(), threading.Event()

    def source() -> Iterator[LiveFrame]:
        yield frame(0)
        assert taken.wait(LONGEST)
        yield from map(frame, range(100, 200))
        all_read.set()

    frames = queue_frames(source())
    assert next(frames).number == 0
    taken.set()
    assert all_read.wait(LONGEST)
    assert [each.number for each in frames] == [199]


def test_an_error_of_the_source_is_raised_after_its_frames() -> None:
    def source() -> Iterator[LiveFrame]:
        yield frame(0)
        raise InputError("unplugged")

    frames = queue_frames(source())
    assert next(frames).number == 0
    with pytest.raises(InputError, match="unplugged"):
        next(frames)


def test_the_thread_ends_with_the_consumer() -> None:
    read: list[int] = []
    gate = threading.Semaphore(0)

    def source() -> Iterator[LiveFrame]:
        for number in range(1000):
            read.append(number)
            yield frame(number)
            gate.acquire(timeout=LONGEST)

    frames = queue_frames(source())
    next(frames)
    frames.close()  # type: ignore[attr-defined]
    gate.release(1000)
    for thread in threading.enumerate():
        if thread.name == "live-frames":
            thread.join(LONGEST)
            assert not thread.is_alive()
    assert len(read) < 1000
