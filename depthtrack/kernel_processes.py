"""Processes that compile kernels into the folder of `compilation` on request."""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Protocol, TextIO

from depthtrack.ahead_compiler import take_shortcuts
from depthtrack.kernel_list import Kernel
from depthtrack.strict_data import json_text, parse_json

_ROOT = Path(__file__).parents[1]


class Child(Protocol):
    """A process that compiles the kernels that it reads."""

    stdin: Any
    stdout: Any

    def kill(self) -> None:
        """End it at once."""

    def wait(self) -> int:
        """Wait for its end."""


def request(child: Child, kernel: Kernel) -> bool:
    """Return whether a process has answered the request to compile a kernel."""
    return _send(child, kernel._asdict()) and bool(child.stdout.readline())


def _send(child: Child, content: Any) -> bool:
    """Write a line to a process; return whether it can be written."""
    try:
        child.stdin.write(json_text(content) + "\n")
        child.stdin.flush()
    except OSError:
        return False
    return True


def start_for(kernels: Sequence[Kernel] | None) -> Child:
    """Start a process that compiles kernels on request.

    kernels: those that have an entry from Python, while all others have none; None for an entry of each, without
        shortcuts in numba.
    """
    # A fork has all modules at once. It needs a process with one thread, and a system whose libraries allow it.
    can_fork = sys.platform == "linux" and threading.active_count() == 1
    child = _Forked() if can_fork else _start()
    _send(child, None if kernels is None else [kernel._asdict() for kernel in kernels])
    return child


class _Forked:
    """A copy of this process that compiles the kernels that it reads."""

    def __init__(self) -> None:
        (answers, answer), (request, requests) = os.pipe(), os.pipe()
        self._process = os.fork()
        if self._process == 0:
            try:
                os.close(requests)
                nowhere = os.open(os.devnull, os.O_RDWR)
                for standard in (0, 1, 2):
                    os.dup2(nowhere, standard)
                _serve(os.fdopen(request), os.fdopen(answer, "w"))
            finally:
                os._exit(0)
        os.close(answer)
        os.close(request)
        self.stdin, self.stdout = os.fdopen(requests, "w"), os.fdopen(answers)

    def kill(self) -> None:
        """End it at once."""
        if self._process:
            os.kill(self._process, signal.SIGKILL)

    def wait(self) -> int:
        """Wait for its end, and close its pipes."""
        if self._process:
            os.waitpid(self._process, 0)
            self._process = 0
            self.stdout.close()
            with suppress(OSError):
                self.stdin.close()
        return 0


def _start() -> Child:
    """Start a process that compiles the kernels that it reads."""
    path = os.pathsep.join([str(_ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
    return subprocess.Popen(
        [sys.executable, "-P", "-m", "depthtrack.kernel_processes"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "PYTHONPATH": path},
        text=True,
    )


def _serve(requests: TextIO, answers: TextIO) -> None:
    """Compile the kernels that the input describes, a line each, and answer each with a line.

    The first line lists all of them, or is null: see `start_for`.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the process that started this one ends it
    listed = parse_json(requests.readline() or "null")
    if listed is not None:
        take_shortcuts({(each.module, each.name, each.signature) for each in (Kernel(**entry) for entry in listed)})
    for line in requests:
        kernel = Kernel(**parse_json(line))
        kernel.dispatcher.compile(kernel.signature)
        print(kernel.name, file=answers, flush=True)


if __name__ == "__main__":
    _serve(sys.stdin, sys.stdout)
