"""Commands in forked processes: the kernels and modules of this process are theirs."""

import faulthandler
import os
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

import cv2
from tqdm import tqdm

from depthtrack.cli import main

FAILED = 99
"""Exit code after an exception that `main` does not handle."""
OVERDUE = -1
"""Exit code of a process that was ended at its time limit."""


@dataclass(frozen=True)
class Ended:
    """End of a command: exit code, or the negative number of the signal that ended it."""

    code: int
    output: str
    error: str

    @property
    def is_orderly(self) -> bool:
        """Whether the code is 0, or 2 with one sentence after any notes."""
        lines = [line for line in self.error.strip().splitlines() if not line.startswith("note: ")]
        return self.code == 0 or (self.code == 2 and len(lines) == 1 and "Traceback" not in self.error)


def run_forked(
    arguments: list[str],
    folder: Path,
    around: Callable[[], Any] = nullcontext,
    limit: float = 60.0,
    act: Callable[[list[str]], int] = main,
) -> Ended:
    """Run a command in a child of this process, and return how it ended.

    folder: current folder of the command.
    around: context of the command.
    limit: seconds after which it is killed.
    act: what the arguments are given to.

    Raises:
        RuntimeError: this process has other threads.
    """
    end_threads()
    with TemporaryFile() as output, TemporaryFile() as error:
        child = os.fork()
        if child == 0:
            os.dup2(output.fileno(), 1)
            os.dup2(error.fileno(), 2)
            sys.stdout, sys.stderr = os.fdopen(1, "w", closefd=False), os.fdopen(2, "w", closefd=False)
            faulthandler.dump_traceback_later(0.9 * limit)  # where it hangs
            os._exit(_run(arguments, folder, around, act))
        code = _wait(child, limit)
        output.seek(0)
        error.seek(0)
        return Ended(code, output.read().decode(errors="replace"), error.read().decode(errors="replace"))


def end_threads() -> None:
    """End the threads of libraries, and wait for others: a lock that one holds stays locked in a forked child.

    Raises:
        RuntimeError: a thread does not end within 5 s.
    """
    cv2.setNumThreads(1)
    tqdm.monitor_interval = 0
    if tqdm.monitor is not None:
        tqdm.monitor.exit()
        tqdm.monitor = None
    end = time.monotonic() + 5.0
    for thread in threading.enumerate():
        if thread is not threading.current_thread():
            thread.join(max(0.0, end - time.monotonic()))
    if threading.active_count() > 1:
        raise RuntimeError(f"threads run beside a fork: {[each.name for each in threading.enumerate()]}")


def _run(arguments: list[str], folder: Path, around: Callable[[], Any], act: Callable[[list[str]], int]) -> int:
    os.chdir(folder)
    code = FAILED
    try:
        with around():
            code = act(arguments)
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else FAILED
    except BaseException:
        traceback.print_exc()
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    return code


def _wait(child: int, limit: float) -> int:
    end = time.monotonic() + limit
    while True:
        found, status = os.waitpid(child, os.WNOHANG)
        if found:
            return os.waitstatus_to_exitcode(status)
        if time.monotonic() > end:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            return OVERDUE
        time.sleep(0.005)
