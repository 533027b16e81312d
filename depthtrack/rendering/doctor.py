"""What works on this machine: versions, processor, and every backend tried in a process of its own."""

import json
import os
import platform
import signal
import subprocess
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Self

import depthtrack
from depthtrack.machine import usable_cores
from depthtrack.rendering.selfcheck import SelfCheck

_LIBRARIES = (
    *("numpy", "scipy", "numba", "llvmlite", "opencv-python-headless", "PyOpenGL", "trimesh", "matplotlib", "tyro"),
    *("rerun-sdk", "pygltflib"),  # extras
)


@dataclass(frozen=True)
class SystemInfo:
    """What the program runs on. `libraries` maps names to versions, None where not installed."""

    depthtrack: str
    python: str
    system: str
    processor: str
    threads: int
    avx2: bool
    avx512: bool
    libraries: dict[str, str | None]

    @classmethod
    def here(cls) -> Self:
        from llvmlite import binding

        features = binding.get_host_cpu_features()
        return cls(
            depthtrack=depthtrack.__version__,
            python=platform.python_version(),
            system=f"{platform.system()} {platform.release()} {platform.machine()}",
            processor=_model_name() or binding.get_host_cpu_name(),
            threads=usable_cores(),
            avx2=bool(features.get("avx2")),
            avx512=bool(features.get("avx512f")),
            libraries={name: _version(name) for name in _LIBRARIES},
        )


@dataclass(frozen=True)
class Trial:
    """A backend to try, with options; `label` names it to people."""

    label: str
    backend: str
    options: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Outcome:
    """What came of a trial: what it measured, or why it measured nothing. `works` only if it agrees with the oracle."""

    trial: Trial
    check: SelfCheck | None
    problem: str | None

    @property
    def works(self) -> bool:
        return self.problem is None


def trials() -> list[Trial]:
    """Everything there is to try on this machine."""
    threads = usable_cores()
    parallel = [Trial(f"raster, {threads} threads", "raster", {"threads": threads})] if threads > 1 else []
    return [
        Trial("raster", "raster"),
        *parallel,
        Trial("egl on a GPU", "egl", {"device": "gpu"}),
        Trial("egl in software", "egl", {"device": "software"}),
        Trial("osmesa", "osmesa"),
        Trial("oracle", "oracle"),
    ]


def examine(
    time_limit: float = 60.0, progress: Callable[[list[Trial]], Iterable[Trial]] = lambda trials: trials
) -> list[Outcome]:
    """Try every backend, one after the other so that each has the machine; `time_limit` seconds each."""
    return [attempt(trial, time_limit) for trial in progress(trials())]


def attempt(trial: Trial, time_limit: float = 60.0) -> Outcome:
    """Self-check a backend in a process of its own, so that a driver may crash or hang there."""
    command = [sys.executable, "-P", "-m", "depthtrack.rendering.selfcheck", trial.backend, json.dumps(trial.options)]
    # Where the program runs from a checkout, its processes find it too.
    path = [str(Path(depthtrack.__file__).parent.parent), os.environ.get("PYTHONPATH")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, path))}
    with subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
        env=environment,
        start_new_session=True,
    ) as process:
        try:
            printed, complaints = process.communicate(timeout=time_limit)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            return Outcome(
                trial, None, f"gave no answer within {time_limit:g} s: its driver hangs, or the machine is busy"
            )
        except BaseException:
            os.killpg(process.pid, signal.SIGKILL)
            raise
    return _outcome(trial, process.returncode, printed, complaints)


def _outcome(trial: Trial, code: int, printed: str, complaints: str) -> Outcome:
    last_words = (complaints.strip().splitlines() or ["it left no message"])[-1]
    if code < 0:
        return Outcome(trial, None, f"crashed with {signal.Signals(-code).name}: {last_words}")
    try:
        # Drivers may print to standard output too: ours is the last line.
        answer = json.loads((printed.strip().splitlines() or [""])[-1])
        if "error" in answer:
            return Outcome(trial, None, str(answer["error"]))
        check = SelfCheck(**answer)
    except (ValueError, TypeError):
        return Outcome(trial, None, f"failed with exit code {code}: {last_words}")
    return Outcome(trial, check, None if check.agrees else "disagrees with the oracle: its driver miscalculates")


def _model_name() -> str | None:
    """The processor's name for people, where the system tells it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return None
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), None)


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None
