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
    """A processor, its vector instructions, versions, and `load`, the runnable processes of the last minute."""

    cpu: str
    cores: int
    features: tuple[str, ...]
    system: str
    versions: dict[str, str] = field(default_factory=dict)
    load: float | None = None

    @property
    def headline(self) -> str:
        """The first line above a table of speeds."""
        busy = "" if self.load is None else f", load {self.load:.1f}"
        return f"{self.cpu}, {self.cores} cores{busy}"


def usable_cores() -> int:
    """Return the number of cores that this process may use; all cores if the system does not report it."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def describe_machine() -> Machine:
    """Return this machine as it is now."""
    from llvmlite.binding import get_host_cpu_features

    present = get_host_cpu_features()
    return Machine(
        cpu=_cpu_model(),
        cores=usable_cores(),
        features=tuple(name for name in _FEATURES if present.get(name)),
        system=f"{platform.system()} {platform.release()} {platform.machine()}",
        versions={"depthtrack": __version__, "python": platform.python_version(), **_versions()},
        load=os.getloadavg()[0] if hasattr(os, "getloadavg") else None,
    )


def _cpu_model() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    models = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(models, platform.processor() or "unknown")


def _versions() -> dict[str, str]:
    found = {}
    for package in _PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found
