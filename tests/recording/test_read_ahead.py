"""Reading ahead keeps the order, the errors and the bound."""

import threading
from collections.abc import Iterator
from typing import Any

import pytest

from depthtrack.errors import DamagedFrameError
from depthtrack.recording.read_ahead import read_ahead


class Source:
    """Numbers in place of frames; counts those that were read."""

    def __init__(self, length: int, fails_at: int | None = None) -> None:
        self.length, self.fails_at, self.read = length, fails_at, 0

    def __iter__(self) -> Iterator[Any]:
        for number in range(self.length):
            if number == self.fails_at:
                raise DamagedFrameError(f"frame {number} is damaged")
            self.read += 1
            yield number


@pytest.mark.parametrize("count", [0, 1, 2, 100])
@pytest.mark.parametrize("length", [0, 1, 7])
def test_frames_keep_their_order(count: int, length: int) -> None:
    assert list(read_ahead(Source(length), count)) == list(range(length))


def test_no_more_frames_are_read_than_stated() -> None:
    source = Source(100)
    frames = read_ahead(source, 3)
    for number in range(10):
        assert next(frames) == number
        assert source.read <= number + 1 + 3
    frames.close()  # type: ignore[attr-defined]


@pytest.mark.parametrize("count", [0, 2])
def test_an_error_is_raised_at_its_place(count: int) -> None:
    frames = read_ahead(Source(9, fails_at=4), count)
    assert [next(frames) for _ in range(4)] == [0, 1, 2, 3]
    with pytest.raises(DamagedFrameError, match="frame 4"):
        next(frames)


def test_the_thread_ends_with_the_iteration() -> None:
    before = set(threading.enumerate())
    frames = read_ahead(Source(9), 2)
    next(frames)
    (own,) = (thread for thread in set(threading.enumerate()) - before if thread.name.startswith("read-ahead"))
    frames.close()  # type: ignore[attr-defined]
    own.join(120)
    assert not own.is_alive()
