"""`depthtrack warmup`: compile the kernels ahead of the first run."""

from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from depthtrack.kernel_list import Kernel

_FEW = 3.0
"""Seconds of compilation that start no processes, and that are left when tracking begins."""
_OTHER_COMMANDS = ("depthtrack.synthesis", "depthtrack.markers")
"""Packages that no tracker calls."""
_MEASURING = (
    "depthtrack.calibration",
    "depthtrack.hand.skin.displacement",
    "depthtrack.rendering.triangles",
    "depthtrack.rendering.raycast",
)
"""Packages whose kernels measure a hand."""
_OTHER_TRACKERS = (
    "depthtrack.solver.gauss_newton",
    "depthtrack.tracking.surfaces.capsules",
    "depthtrack.tracking.visible_centroid",
)
"""Modules whose kernels trackers of the skin do not call: of cylinders, swarms alone, and keypoints."""
_MEASURING_AND_TRACKING = ("depthtrack.solver.linear_algebra",)
"""Modules that the measurement of a hand and other trackers call."""
_SKIN_TRACKERS = ("hybrid", "ik")


@dataclass(frozen=True)
class Command:
    """Compile the kernels of trackers and marker layouts, so that no first run is late.

    One process per core compiles. The code is kept for later runs: run this once when you make a container.
    `depthtrack doctor` states the folder, and NUMBA_CACHE_DIR changes it.
    """

    def run(self) -> None:
        from time import perf_counter

        from depthtrack.compilation import cache_folder
        from depthtrack.errors import DepthtrackError

        begun, folder = perf_counter(), cache_folder()
        if folder is None:
            raise DepthtrackError("no folder for compiled kernels is writable: set NUMBA_CACHE_DIR to one that is")
        processes = compile_absent()
        shared = f" in {processes} processes" if processes > 1 else ""
        print(f"kernels compiled in {perf_counter() - begun:.0f} s{shared}; they are kept in {folder}")


def compile_absent() -> int:
    """Compile the listed kernels that are not kept yet; return the number of processes."""
    from depthtrack.kernel_list import absent_kernels, listed_kernels
    from depthtrack.precompilation import compile_kernels

    absent = absent_kernels(listed_kernels())
    with _counter(absent) as show:
        return compile_kernels(absent, show)


@contextmanager
def compiled_ahead(tracker: str = "", measures: bool = False) -> "Iterator[Callable[[], None]]":
    """Compile the absent kernels of a tracker in several processes, if there are cores.

    Yields a function that waits for nearly all of them, behind a progress bar.

    tracker: its name; the kernels of all if it is empty.
    measures: whether the hand is measured as well.
    """
    from depthtrack.compilation import cache_folder
    from depthtrack.machine import usable_cores

    if usable_cores() == 1 or cache_folder() is None:
        yield lambda: None
        return
    from depthtrack.kernel_list import absent_kernels, listed_kernels
    from depthtrack.precompilation import CompilationAhead

    without = _OTHER_COMMANDS + (() if measures else _MEASURING)
    without += _OTHER_TRACKERS if tracker in _SKIN_TRACKERS else ()
    without += _MEASURING_AND_TRACKING if tracker in _SKIN_TRACKERS and not measures else ()
    absent = absent_kernels([each for each in listed_kernels() if not each.module.startswith(without)])
    if sum(each.seconds for each in absent) <= _FEW:
        yield lambda: None
        return

    def wait() -> None:
        with _counter(absent) as show:
            running.wait(_FEW, show)

    with CompilationAhead(absent) as running:
        yield wait  # kernels that are not finished at the end of a short run were not called


@contextmanager
def _counter(kernels: "Sequence[Kernel]") -> "Iterator[Callable[[Kernel], None]]":
    """Yield a function that shows the kernels that were compiled."""
    from depthtrack.cli.progress import counter

    with counter(len(kernels), unit="kernel") as shown:
        shown.set_description_str("compiling, once")

        def show(kernel: "Kernel") -> None:
            shown.set_postfix_str(kernel.name)
            shown.update()

        yield show
