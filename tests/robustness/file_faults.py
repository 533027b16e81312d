"""A file layer that fails at the N-th operation: a full disk, an error of the disk, a short write, or a kill.

It stands between Python and the system: each write, fsync and rename of files below one folder is counted. What C
libraries write by themselves, such as videos, is not seen.
"""

import builtins
import errno
import io
import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal
from unittest import mock

from depthtrack import files

Fault = Literal["none", "full", "broken", "short", "killed"]
"""`full`: the disk is full from then on. `broken`: one error. `short`: half is written, which is no error."""
FAULTS: tuple[Fault, ...] = ("full", "broken", "short", "killed")


class FaultyDisk:
    """Counter of the operations below a folder, which fails at one of them.

    at: number of the operation that fails, from 1.
    operations: what was done so far, as `write name`.
    """

    def __init__(self, folder: Path, fault: Fault = "none", at: int = 0) -> None:
        self._folder, self._fault, self._at = os.path.realpath(folder), fault, at
        self.operations: list[str] = []

    def sees(self, path: Any) -> bool:
        """Return whether a path lies below the folder."""
        return isinstance(path, str | os.PathLike) and os.path.abspath(path).startswith(self._folder + os.sep)

    def begin(self, operation: str, path: Any) -> bool:
        """Count an operation, and raise its error; return whether it must be done by half.

        Raises:
            OSError: the disk is full or broken.
        """
        self.operations.append(f"{operation} {os.path.basename(os.fspath(path))}")
        number = len(self.operations)
        if self._fault == "full" and number >= self._at and operation != "rename":
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        if self._fault == "broken" and number == self._at:
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        if self._fault == "killed" and number == self._at and operation != "write":
            os.kill(os.getpid(), signal.SIGKILL)
        return self._fault in ("short", "killed") and number == self._at

    def end(self) -> None:
        """End the process after half an operation, if it must be killed."""
        if self._fault == "killed":
            os.kill(os.getpid(), signal.SIGKILL)

    @contextmanager
    def installed(self) -> Iterator[None]:
        """Stand between Python and the system within the block."""
        real_open, fsync, exchange = io.open, os.fsync, files._exchange
        handles: dict[int, str] = {}

        def open_file(path: Any, mode: str = "r", buffering: int = -1, *arguments: Any, **options: Any) -> Any:
            if not self.sees(path) or not set(mode) & set("wax+") or "opener" in options:
                return real_open(path, mode, buffering, *arguments, **options)
            raw = _FaultyFile(self, path, mode.replace("b", "").replace("t", ""))
            handles[raw.fileno()] = os.fspath(path)
            buffered: Any = io.BufferedRandom(raw) if "+" in mode else io.BufferedWriter(raw)
            return buffered if "b" in mode else io.TextIOWrapper(buffered, *arguments, **options)

        def checked(rename: Any) -> Any:
            def renamed(source: Any, target: Any, **options: Any) -> Any:
                if self.sees(target):
                    self.begin("rename", target)
                return rename(source, target, **options)

            return renamed

        def stored(handle: int) -> None:
            if handle in handles:
                self.begin("fsync", handles[handle])
            fsync(handle)

        with (
            mock.patch.object(io, "open", open_file),
            mock.patch.object(builtins, "open", open_file),
            mock.patch.object(os, "rename", checked(os.rename)),
            mock.patch.object(os, "replace", checked(os.replace)),
            mock.patch.object(os, "fsync", stored),
            mock.patch.object(files, "_exchange", checked(exchange)),
        ):
            yield


class _FaultyFile(io.FileIO):
    """Unbuffered file on a faulty disk."""

    def __init__(self, disk: FaultyDisk, path: Any, mode: str) -> None:
        super().__init__(path, mode)
        self._disk, self._path = disk, path

    def write(self, data: Any) -> int:
        if not self._disk.begin("write", self._path):
            return super().write(data) or 0
        half = super().write(bytes(data)[: (len(data) + 1) // 2]) or 0
        self._disk.end()
        return half
