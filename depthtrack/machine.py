"""The machine of a measurement: processor, cores and versions."""

import os
import platform
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from depthtrack import __version__

_FEATURES = ("sse4.2", "avx", "avx2", "fma", "avx512f", "avx512vl", "neon", "sve")
_PACKAGES = ("numpy", "numba", "llvmlite", "scipy", "PyOpenGL", "trimesh", "embreex", "open3d", "pyrender")


@dataclass(frozen=True)
class Machine:
    """A processor and its software.

    features: vector instruction sets.
    versions: of depthtrack, Python and packages.
    load: mean number of runnable processes over the last minute; None if the system does not report it.
    """

    cpu: str
    cores: int
    features: tuple[str, ...]
    system: str
    versions: dict[str, str] = field(default_factory=dict)
    load: float | None = None

    @property
    def headline(self) -> str:
        """The line above a table of speeds."""
        busy = "" if self.load is None else f", load {self.load:.1f}"
        return f"{self.cpu}, {self.cores} cores{busy}"


def usable_cores() -> int:
    """Return the number of cores that this process may use; all if the system reports no limit."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def describe_machine() -> Machine:
    """Return a description of this machine."""
    from llvmlite.binding import get_host_cpu_features

    present = get_host_cpu_features()
    return Machine(
        cpu=processor_name(),
        cores=usable_cores(),
        features=tuple(name for name in _FEATURES if present.get(name)),
        system=system_name(),
        versions={"depthtrack": __version__, "python": platform.python_version(), **_versions()},
        load=os.getloadavg()[0] if hasattr(os, "getloadavg") else None,
    )


def system_name() -> str:
    """Return the operating system, its release and the architecture."""
    return f"{platform.system()} {platform.release()} {platform.machine()}"


def processor_name() -> str:
    """Return the processor's model name; its architecture if the model is not reported."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        lines = []
    models = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(models, platform.processor() or "unknown")


def installed_version(package: str) -> str | None:
    """Return the version of a package, None if it is not installed."""
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _versions() -> dict[str, str]:
    found = {package: installed_version(package) for package in _PACKAGES}
    return {package: number for package, number in found.items() if number is not None}
