"""Compilation of kernels ahead of their first use, in several processes.

Each process compiles listed kernels one after the other into the folder of `compilation`, parts of others first. A
kernel that is not listed, or whose process fails, is compiled at its first use.
"""

import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from queue import SimpleQueue
from typing import Any

from numba.core.dispatcher import Dispatcher
from numba.core.registry import cpu_target

from depthtrack import kernel_processes
from depthtrack.closing import Closing
from depthtrack.compilation import KernelCache
from depthtrack.kernel_list import Kernel
from depthtrack.kernel_processes import Child, request
from depthtrack.machine import usable_cores


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

    def hurry(self, number: int) -> None:
        """Put a kernel that waits, and its parts, before all others."""
        with self._changed:
            wanted = {number} | self._parts[number]
            self._waiting.sort(key=lambda n: n not in wanted)

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


class CompilationAhead(Closing):
    """Compilation of kernels in processes, while this process goes on.

    A call of a kernel that is not finished waits for it. At most one process per core compiles. They end with `close`,
    also if that comes early.
    """

    def __init__(self, kernels: Sequence[Kernel]) -> None:
        self._kernels, self._waiting, self._is_over = kernels, PartsFirst(kernels), False
        self._numbers = {(each.module, each.name, each.signature): n for n, each in enumerate(kernels)}
        self._events = [threading.Event() for _ in kernels]
        self._unfinished, self._finished = sum(each.seconds for each in kernels), SimpleQueue[Kernel | None]()
        self.processes = min(usable_cores(), len(kernels))
        """Number of processes."""
        if kernels:
            cpu_target.target_context.refresh()  # once, before processes are forked
        self._children: list[Child] = [kernel_processes.start_for(kernels) for _ in range(self.processes)]
        self._working, self._pool = self.processes, ThreadPoolExecutor(max(self.processes, 1))
        self._threads = [self._pool.submit(self._work, child) for child in tuple(self._children)]
        _await_kernels(self._wait_for)

    def wait(self, seconds: float = 0.0, compiled: Callable[[Kernel], None] = lambda kernel: None) -> None:
        """Wait until kernels of so many seconds of compilation remain.

        compiled: receives each kernel that is compiled.
        """
        while self._working and self._unfinished > seconds:
            kernel = self._finished.get()
            if kernel is None:
                self._working -= 1
            else:
                self._unfinished -= kernel.seconds
                compiled(kernel)
        for thread in self._threads:
            if thread.done():
                thread.result()

    def close(self) -> None:
        """End all processes."""
        self._is_over = True
        _await_kernels(lambda function, types: False)
        self._waiting.stop()
        self._pool.shutdown(wait=False, cancel_futures=True)
        for child in self._children:
            child.kill()
        for child in self._children:
            child.wait()
        for event in self._events:
            event.set()

    def _work(self, child: Child) -> None:
        try:
            while (number := self._waiting.take()) is not None:
                kernel = self._kernels[number]
                if not request(child, kernel) and not self._is_over:
                    # The other one has failed, perhaps by its shortcuts: its kernel is compiled at its first use.
                    child = kernel_processes.start_for(None)
                    self._children.append(child)
                self._waiting.finish(number)
                self._events[number].set()
                self._finished.put(kernel)
        finally:
            self._finished.put(None)

    def _wait_for(self, function: Callable[..., Any], types: Any) -> bool:
        """Wait for a kernel, which is compiled next; return whether it is among those that were compiled."""
        number = self._numbers.get((function.__module__, function.__name__, tuple(types)))
        if number is None:
            return False
        self._waiting.hurry(number)
        while not self._events[number].wait(1.0):
            if all(thread.done() for thread in self._threads):
                return False
        return True


def _await_kernels(wait_for: Callable[[Callable[..., Any], Any], bool]) -> None:
    """Set the function that waits for code of other processes."""
    kept: Any = KernelCache
    kept.wait_for = staticmethod(wait_for)


def compile_kernels(kernels: Sequence[Kernel], compiled: Callable[[Kernel], None] = lambda kernel: None) -> int:
    """Compile kernels into the folder for compiled code; return the number of processes.

    compiled: receives each kernel that is compiled.
    """
    with CompilationAhead(kernels) as running:
        running.wait(compiled=compiled)
    return running.processes
