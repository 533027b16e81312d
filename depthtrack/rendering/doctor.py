"""Diagnosis of this machine: versions, processor, and a trial of every backend."""

import os
import platform
import signal
import subprocess
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

import depthtrack
from depthtrack.compilation import cache_folder
from depthtrack.machine import installed_version, processor_name, system_name, usable_cores
from depthtrack.rendering.selfcheck import SelfCheck
from depthtrack.strict_data import exact_json_text, parse_json

_LIBRARIES = (
    *(
        "numpy",
        "scipy",
        "numba",
        "llvmlite",
        "deflate",
        "opencv-python-headless",
        "PyOpenGL",
        "trimesh",
        "matplotlib",
        "tyro",
    ),
    *("rerun-sdk", "pygltflib"),  # extras
)


@dataclass(frozen=True)
class SystemInfo:
    """Versions, system and processor.

    libraries: versions by name, None if not installed.
    compiled_kernels: folder that holds compiled kernels between runs, None without a writable one.
    """

    depthtrack: str
    python: str
    system: str
    processor: str
    threads: int
    avx2: bool
    avx512: bool
    libraries: dict[str, str | None]
    compiled_kernels: str | None

    @classmethod
    def here(cls) -> Self:
        """Return the description of this machine."""
        from llvmlite import binding

        features = binding.get_host_cpu_features()
        return cls(
            depthtrack=depthtrack.__version__,
            python=platform.python_version(),
            system=system_name(),
            processor=processor_name(),
            threads=usable_cores(),
            avx2=bool(features.get("avx2")),
            avx512=bool(features.get("avx512f")),
            libraries={name: installed_version(name) for name in _LIBRARIES},
            compiled_kernels=None if (folder := cache_folder()) is None else str(folder),
        )


@dataclass(frozen=True)
class Trial:
    """A backend to try with its options; `label` is its name in reports."""

    label: str
    backend: str
    options: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Outcome:
    """The result of a trial: its self-check, and the problem if the backend does not work.

    check: None if the process failed before it reported.
    """

    trial: Trial
    check: SelfCheck | None
    problem: str | None

    @property
    def works(self) -> bool:
        """Whether the backend ran and agrees with the oracle."""
        return self.problem is None


def trials() -> list[Trial]:
    """Return all trials of this machine, the default backend first."""
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
    """Try every backend, one at a time, with a time limit each (seconds)."""
    return [attempt(trial, time_limit) for trial in progress(trials())]


def attempt(trial: Trial, time_limit: float = 60.0) -> Outcome:
    """Self-check a backend in its own process, which contains a driver that crashes or hangs.

    time_limit: seconds, after which the process is killed.
    """
    program = [sys.executable, "-P", "-m", "depthtrack.rendering.selfcheck"]
    command = [*program, trial.backend, exact_json_text(trial.options)]
    # A child process finds the package of a checkout by this path.
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
            output, errors = process.communicate(timeout=time_limit)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            return Outcome(
                trial, None, f"gave no result within {time_limit:g} s: its driver hangs, or the machine is busy"
            )
        except BaseException:
            os.killpg(process.pid, signal.SIGKILL)
            raise
    return _outcome(trial, process.returncode, output, errors)


def _outcome(trial: Trial, code: int, output: str, errors: str) -> Outcome:
    last_line = (errors.strip().splitlines() or ["no message"])[-1]
    if code < 0:
        return Outcome(trial, None, f"crashed with {signal.Signals(-code).name}: {last_line}")
    try:
        # Drivers may print to standard output too; the result is the last line.
        answer = parse_json((output.strip().splitlines() or [""])[-1])
        if "error" in answer:
            return Outcome(trial, None, str(answer["error"]))
        check = SelfCheck(**answer)
    except (ValueError, TypeError):
        return Outcome(trial, None, f"failed with exit code {code}: {last_line}")
    return Outcome(trial, check, None if check.agrees else "disagrees with the oracle: its driver computes wrongly")
