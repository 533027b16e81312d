"""A thread that waits for one call at a time: cheaper to wake than a pool's queue, thousands of times a second."""

import threading
from collections.abc import Callable
from typing import Any


class Helper:
    """Runs one call at a time beside its owner. A daemon: it never keeps a program from ending."""

    def __init__(self) -> None:
        self._go, self._done = threading.Lock(), threading.Lock()
        self._go.acquire()
        self._done.acquire()
        self._call: Callable[[], Any] | None = None
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._run, daemon=True, name="depthtrack-raster")
        self._thread.start()

    def start(self, function: Callable[..., Any], *arguments: Any) -> None:
        """Begin a call; `wait` must follow before the next one."""
        self._call = lambda: function(*arguments)
        self._go.release()

    def wait(self) -> None:
        """Until the call is done; raises what it raised."""
        self._done.acquire()
        error, self._error = self._error, None
        if error is not None:
            raise error

    def stop(self) -> None:
        """End the thread."""
        self._call = None
        self._go.release()
        self._thread.join()

    def _run(self) -> None:
        while True:
            self._go.acquire()
            if self._call is None:
                return
            try:
                self._call()
            except BaseException as error:
                self._error = error
            self._done.release()
