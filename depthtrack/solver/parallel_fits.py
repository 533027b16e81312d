"""Fits of several poses to one observation, side by side in threads.

The fits share nothing that they write, so the number of threads changes no bit.
"""

import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait

from depthtrack.solver.icp import IcpFitter
from depthtrack.types import Array

Fit = Callable[[IcpFitter, Array], Array]
"""Returns a pose (27,) fitted from another one."""


class ParallelFits:
    """Threads that share fits. They start with the first fits.

    threads: number of threads, the calling one included.
    """

    def __init__(self, threads: int) -> None:
        self._others = threads - 1
        self._pool: ThreadPoolExecutor | None = None

    def fit_each(
        self, fitter: IcpFitter, poses: Sequence[Array] | Array, fit: Fit, is_over: Callable[[], bool] = lambda: False
    ) -> list[Array]:
        """Return the fitted poses (27,), in the order of their starts.

        poses: (27,) to start from.
        fit: receives `fitter` or a twin of it.
        is_over: whether the rest of the poses is left out; asked before each fit.
        """
        fitted, lock = list[Future[Array]](), threading.Lock()

        def work(own: IcpFitter) -> None:
            while True:
                with lock:
                    if len(fitted) == len(poses) or is_over():
                        return
                    fitted.append(found := Future[Array]())
                    pose = poses[len(fitted) - 1]
                try:
                    found.set_result(fit(own, pose))
                except BaseException as error:
                    found.set_exception(error)

        helpers = (fitter.twin(n) for n in range(min(self._others, len(poses) - 1)))
        shared = [self._threads().submit(work, twin) for twin in helpers if twin is not None]
        work(fitter)
        wait(shared)
        return [each.result() for each in fitted]

    def _threads(self) -> ThreadPoolExecutor:
        if self._pool is None:
            self._pool = ThreadPoolExecutor(self._others, "fits")
        return self._pool

    def close(self) -> None:
        """End the threads."""
        if self._pool is not None:
            self._pool.shutdown()
            self._pool = None
