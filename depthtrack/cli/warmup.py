"""`depthtrack warmup`: compile the kernels ahead of the first run."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from depthtrack.precompilation import Kernel

_FEW = 3.0
"""Seconds of compilation that start no processes: they take a second or two to load the program."""
_OTHER_COMMANDS = ("depthtrack.calibration", "depthtrack.synthesis", "depthtrack.markers")
"""Packages that no tracker calls."""
_OTHER_TRACKERS = (
    "depthtrack.solver.gauss_newton",
    "depthtrack.solver.linear_algebra",
    "depthtrack.tracking.surfaces.capsules",
    "depthtrack.tracking.visible_centroid",
)
"""Modules whose kernels trackers of the skin do not call: of cylinders, swarms alone, and keypoints."""
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


def compile_absent(few: float = 0.0, without: tuple[str, ...] = ()) -> int:
    """Compile the listed kernels that are not kept yet; return the number of processes.

    few: seconds of compilation up to which nothing is done.
    without: packages to leave out.
    """
    from depthtrack.cli.progress import counter
    from depthtrack.precompilation import absent_kernels, compile_kernels, listed_kernels

    absent = absent_kernels([each for each in listed_kernels() if not each.module.startswith(without)])
    if sum(each.seconds for each in absent) <= few:
        return 0
    with counter(len(absent), unit="kernel") as shown:
        shown.set_description_str("compiling, once")

        def show(kernel: "Kernel") -> None:
            shown.set_postfix_str(kernel.name)
            shown.update()

        return compile_kernels(absent, show)


def compile_for_first_use(tracker: str = "") -> None:
    """Compile the absent kernels of a tracker in several processes, if there are cores.

    tracker: its name; the kernels of all if it is empty.
    """
    from depthtrack.compilation import cache_folder
    from depthtrack.machine import usable_cores

    if usable_cores() > 1 and cache_folder() is not None:
        compile_absent(_FEW, _OTHER_COMMANDS + (_OTHER_TRACKERS if tracker in _SKIN_TRACKERS else ()))
