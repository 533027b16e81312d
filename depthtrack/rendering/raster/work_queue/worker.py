"""A thread that helps with batches, and lingers a while for the next one: far cheaper than being woken for each."""

import threading
from collections.abc import Callable


class Helper:
    """Calls `work` when woken; that returns when there has been nothing to do for a while.

    A daemon: it never keeps a program from ending.
    """

    def __init__(self, work: Callable[[], None]) -> None:
        self._work = work
        self._go = threading.Lock()
        self._go.acquire()
        self._asleep, self._stops = True, False
        self._thread = threading.Thread(target=self._run, daemon=True, name="depthtrack-raster")
        self._thread.start()

    @property
    def is_idle(self) -> bool:
        return self._asleep or not self._thread.is_alive()

    def wake(self) -> None:
        """Have `work` called unless it runs already; if that is about to return, this call has no effect."""
        if self._asleep:
            self._asleep = False
            self._go.release()

    def stop(self) -> None:
        """End the thread, once `work` has returned."""
        self._stops = True
        self.wake()
        if self._thread is not threading.current_thread():
            self._thread.join()

    def _run(self) -> None:
        while not self._stops:
            self._go.acquire()
            try:
                if not self._stops:
                    self._work()
            finally:
                self._asleep = True
