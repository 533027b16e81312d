"""Reading ahead: the next frames are decoded in a thread while the current one is tracked."""

from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from itertools import islice
from typing import TypeVar

T = TypeVar("T")


def read_ahead(frames: Iterable[T], count: int) -> Iterator[T]:
    """Yield frames in order, and read the next ones in a thread.

    count: frames read before they are needed; 0 reads each when it is needed.

    An error of the reader is raised at its place in the order.
    """
    if count == 0:
        yield from frames
        return
    source = iter(frames)
    with ThreadPoolExecutor(1, "read-ahead") as thread:
        waiting: deque[Future[list[T]]] = deque(thread.submit(_next, source) for _ in range(count))
        try:
            while found := waiting.popleft().result():
                waiting.append(thread.submit(_next, source))
                yield found[0]
        finally:
            for future in waiting:
                future.cancel()


def _next(source: Iterator[T]) -> list[T]:
    """Return the next frame; nothing after the last one."""
    return list(islice(source, 1))
