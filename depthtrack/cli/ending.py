"""Ends of a command by a signal or by a closed output."""

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType

INTERRUPTED, TERMINATED, BROKEN_PIPE = (128 + number for number in (2, 15, 13))
"""Exit codes: 128 plus the number of the signal, as shells report it."""


class Terminated(KeyboardInterrupt):
    """The process was asked to end by SIGTERM."""


@contextmanager
def terminable() -> Iterator[None]:
    """Raise Terminated on SIGTERM within the block, so that unfinished files are removed."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, _terminate)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def write_output() -> None:
    """Write what is buffered for the output; a reader that has closed it needs no more.

    Raises:
        OSError: the output cannot be written.
    """
    if sys.stdout is not None:
        with suppress(BrokenPipeError):
            sys.stdout.flush()


def drop_unwritable_output() -> None:
    """Drop output that cannot be written, which Python would report at its end."""
    if sys.stdout is None:
        return
    try:
        sys.stdout.flush()
    except OSError:
        with suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _terminate(number: int, frame: FrameType | None) -> None:
    raise Terminated
