"""Limits of time and memory around one read, and what comes out of it."""

import resource
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path

from depthtrack.errors import DepthtrackError

SECONDS = 2.0
"""CPU time of one read at most, without other processes, whose load would count in wall-clock time."""
MEMORY = 1 << 30
"""Bytes that a read may reserve beyond what the process has."""


class Outcome(StrEnum):
    """What a reader did with a file."""

    READ = "read"
    REFUSED = "refused"
    CUT = "cut"
    """Read with less than the file held before the change."""


class FaultError(Exception):
    """A file that ended a reader in another way than by its result or its error.

    data: the file.
    """

    data: bytes = b""


class _TimeLimit(BaseException):
    """Raised by the timer; no reader handles it."""


def outcome(read: Callable[[Path], int], path: Path, whole: int) -> Outcome:
    """Return what a reader does with the files at a path.

    read: returns the number of items read.
    whole: number of items before the change.

    Raises:
        FaultError: if the reader raises another error than ours, or exceeds a limit.
    """
    try:
        with time_limit(SECONDS):
            count = read(path)
    except DepthtrackError as error:
        message = str(error)
        if not message.isprintable() or len(message) > 2000:
            raise FaultError(f"the message must be a printable line, found {message[:80]!r}") from error
        return Outcome.REFUSED
    except _TimeLimit:
        raise FaultError(f"more than {SECONDS} s of CPU time, or it waits") from None
    except (Exception, RecursionError) as error:
        raise FaultError(f"{type(error).__name__}: {str(error)[:200]}") from error
    return Outcome.CUT if count < whole else Outcome.READ


@contextmanager
def time_limit(seconds: float, waiting: float = 120.0) -> Iterator[None]:
    """Interrupt the block after its CPU time, or after a longer wall-clock time.

    waiting: the latter, in seconds; a block that waits for a pipe uses no CPU time.
    """
    interrupted = False

    def interrupt(*_: object) -> None:
        nonlocal interrupted
        interrupted = True
        raise _TimeLimit

    timers = {signal.SIGVTALRM: (signal.ITIMER_VIRTUAL, seconds), signal.SIGALRM: (signal.ITIMER_REAL, waiting)}
    before = {number: signal.signal(number, interrupt) for number in timers}
    for timer, limit in timers.values():
        signal.setitimer(timer, limit)
    try:
        yield
    finally:
        for timer, _ in timers.values():
            signal.setitimer(timer, 0)
        for number, handler in before.items():
            signal.signal(number, handler)
        if interrupted:
            raise _TimeLimit  # C code may have taken the first one for an error of the file


@contextmanager
def memory_limit(extra: int = MEMORY) -> Iterator[None]:
    """Limit the address space of the process, so that larger reservations raise MemoryError."""
    pages = int(Path("/proc/self/statm").read_text().split()[0]) if Path("/proc/self/statm").exists() else 0
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    if pages:
        resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + extra, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))
