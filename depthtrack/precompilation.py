"""Compilation of kernels ahead of their first use, in several processes.

`kernels.json` lists the kernels that trackers, searches for layouts and calibration call, with the types of their
arguments. Each process compiles one after the other into the folder of `compilation`, parts of others first. A kernel
that is not listed, or whose process fails, is compiled at its first use.
"""

import re
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from os import environ, pathsep
from pathlib import Path
from queue import SimpleQueue
from typing import Any, NamedTuple

from numba import types
from numba.core.dispatcher import Dispatcher

from depthtrack.ahead_compiler import take_shortcuts
from depthtrack.compilation import cache_folder
from depthtrack.machine import usable_cores
from depthtrack.strict_data import json_text, parse_json

LIST = Path(__file__).with_name("kernels.json")
_ROOT = Path(__file__).parents[1]
_ARRAY = re.compile(r"(\w+)\[(\d)([ACF])\]( readonly)?")


class Kernel(NamedTuple):
    """A compiled function and the types of its arguments.

    arguments: a text for a scalar or an array, a list for a tuple, a dictionary with one key for a named tuple.
    seconds: time to compile it, for the order alone.
    """

    module: str
    name: str
    arguments: list[Any]
    seconds: float

    @property
    def dispatcher(self) -> Any:
        """The function as numba sees it."""
        return getattr(import_module(self.module), self.name)

    @property
    def signature(self) -> tuple[types.Type, ...]:
        """Numba types of the arguments."""
        return tuple(map(type_of, self.arguments))

    @property
    def is_kept(self) -> bool:
        """Whether the folder for compiled code has it."""
        dispatcher = self.dispatcher
        return bool(dispatcher._cache.keeps(self.signature, dispatcher.targetctx))


def listed_kernels() -> list[Kernel]:
    """Return the kernels of the list, those that take longest first."""
    return [Kernel(**entry) for entry in parse_json(LIST.read_text(encoding="utf-8"))]


def type_of(text: Any) -> types.Type:
    """Return the numba type that a description of `kernels.json` names.

    Raises:
        ValueError: if it describes none.
    """
    if isinstance(text, list):
        return types.BaseTuple.from_types([type_of(each) for each in text])
    if isinstance(text, dict):
        ((name, members),) = text.items()
        module, _, attribute = name.rpartition(".")
        named = getattr(import_module(module), attribute)
        return types.BaseTuple.from_types([type_of(each) for each in members], named)
    if match := _ARRAY.fullmatch(text):
        return types.Array(type_of(match[1]), int(match[2]), match[3], readonly=match[4] is not None)
    scalar = getattr(types, text, None)
    if not isinstance(scalar, types.Number | types.Boolean):
        raise ValueError(f"no type is named {text!r}")
    return scalar


def text_of(found: types.Type) -> Any:
    """Return the description of a numba type, from which `type_of` makes it.

    Raises:
        ValueError: if `kernels.json` has no description of such types.
    """
    if isinstance(found, types.BaseNamedTuple):
        members = found.types if isinstance(found, types.NamedTuple) else [found.dtype] * found.count
        name = f"{found.instance_class.__module__}.{found.instance_class.__qualname__}"
        return {name: [text_of(each) for each in members]}
    if isinstance(found, types.BaseTuple):
        return [text_of(each) for each in found]
    if isinstance(found, types.Array):
        return f"{text_of(found.dtype)}[{found.ndim}{found.layout}]" + ("" if found.mutable else " readonly")
    if not isinstance(found, types.Number | types.Boolean):
        raise ValueError(f"a kernel takes {found}: extend precompilation.text_of")
    return "boolean" if found == types.boolean else str(found)


def absent_kernels(kernels: Sequence[Kernel]) -> list[Kernel]:
    """Return the kernels that the folder for compiled code lacks; none without a folder."""
    return [] if cache_folder() is None else [kernel for kernel in kernels if not kernel.is_kept]


class PartsFirst:
    """Kernels in an order in which each one follows the others that it calls.

    Otherwise two processes would compile the same parts at a time. Parts of the longest kernels come first.
    """

    def __init__(self, kernels: Sequence[Kernel]) -> None:
        called = [_parts_of(kernel.dispatcher) for kernel in kernels]
        parts = [{n for n, each in enumerate(kernels) if each.dispatcher in found} for found in called]
        wholes = [[n for n, inside in enumerate(parts) if number in inside] for number in range(len(kernels))]
        longest = [max(kernels[n].seconds for n in (number, *wholes[number])) for number in range(len(kernels))]
        order = range(len(kernels))
        self._kernels, self._parts = kernels, parts
        self._waiting = sorted(order, key=lambda n: (-longest[n], -len(wholes[n]), -kernels[n].seconds))
        self._unfinished, self._changed = set(order), threading.Condition()

    def take(self) -> int | None:
        """Return the number of the next kernel whose parts are finished, once there is one; None after the last."""
        with self._changed:
            while self._waiting:
                for number in self._waiting:
                    if not self._parts[number] & self._unfinished:
                        self._waiting.remove(number)
                        return number
                self._changed.wait()
            return None

    def finish(self, number: int) -> None:
        """State that a kernel was compiled, or never will be."""
        with self._changed:
            self._unfinished.discard(number)
            self._changed.notify_all()

    def stop(self) -> None:
        """Leave out the kernels that wait."""
        with self._changed:
            self._waiting.clear()
            self._changed.notify_all()


def _parts_of(kernel: Any) -> set[Any]:
    """Return the compiled functions that a kernel calls by a global name, directly or not."""
    found, unread = set[Any](), [kernel]
    while unread:
        function = unread.pop().py_func
        named = [function.__globals__.get(name) for name in function.__code__.co_names]
        new = {each for each in named if isinstance(each, Dispatcher)} - found - {kernel}
        found |= new
        unread += new
    return found


def compile_kernels(kernels: Sequence[Kernel], compiled: Callable[[Kernel], None] = lambda kernel: None) -> int:
    """Compile kernels into the folder for compiled code; return the number of processes.

    compiled: receives each kernel that is compiled.

    At most one process per core compiles. They end with this call, also if it is interrupted.
    """
    count = min(usable_cores(), len(kernels))
    children = [_start_for(kernels) for _ in range(count)]
    waiting, finished = PartsFirst(kernels), SimpleQueue[Kernel | None]()

    def work(child: "subprocess.Popen[str]") -> None:
        try:
            while (number := waiting.take()) is not None:
                if not _request(child, kernels[number]) and not is_over:
                    # The other one has failed, perhaps by its shortcuts: its kernel is compiled at its first use.
                    child = _start_for(None)
                    children.append(child)
                waiting.finish(number)
                finished.put(kernels[number])
        finally:
            finished.put(None)

    is_over, pool, working = False, ThreadPoolExecutor(max(count, 1)), count
    try:
        threads = [pool.submit(work, child) for child in tuple(children)]
        while working:
            kernel = finished.get()
            if kernel is None:
                working -= 1
            else:
                compiled(kernel)
        for thread in threads:
            thread.result()
    finally:
        is_over = True
        waiting.stop()
        pool.shutdown(wait=False, cancel_futures=True)
        for child in children:
            child.kill()
        for child in children:
            child.wait()
    return count


def _request(child: "subprocess.Popen[str]", kernel: Kernel) -> bool:
    """Return whether a process has answered the request to compile a kernel."""
    assert child.stdout is not None
    return _send(child, kernel._asdict()) and bool(child.stdout.readline())


def _send(child: "subprocess.Popen[str]", content: Any) -> bool:
    """Write a line to a process; return whether it can be written."""
    assert child.stdin is not None
    try:
        child.stdin.write(json_text(content) + "\n")
        child.stdin.flush()
    except OSError:
        return False
    return True


def _start_for(kernels: Sequence[Kernel] | None) -> "subprocess.Popen[str]":
    """Start a process that compiles kernels on request.

    kernels: those that have an entry from Python, while all others have none; None for an entry of each, without
        shortcuts in numba.
    """
    child = _start()
    _send(child, None if kernels is None else [kernel._asdict() for kernel in kernels])
    return child


def _start() -> "subprocess.Popen[str]":
    """Start a process that compiles the kernels that it reads."""
    path = pathsep.join([str(_ROOT), *filter(None, [environ.get("PYTHONPATH")])])
    return subprocess.Popen(
        [sys.executable, "-P", "-m", "depthtrack.precompilation"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env={**environ, "PYTHONPATH": path},
        text=True,
    )


def _serve() -> None:
    """Compile the kernels that the input describes, a line each, and answer each with a line.

    The first line lists all of them, or is null: see `_start_for`.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the process that started this one ends it
    listed = parse_json(sys.stdin.readline() or "null")
    if listed is not None:
        take_shortcuts({(each.module, each.name, each.signature) for each in (Kernel(**entry) for entry in listed)})
    for line in sys.stdin:
        kernel = Kernel(**parse_json(line))
        kernel.dispatcher.compile(kernel.signature)
        print(kernel.name, flush=True)


if __name__ == "__main__":
    _serve()
