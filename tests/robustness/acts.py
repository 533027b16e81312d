"""What a failing disk is tried on: commands, and the writers under them alone, which take no time."""

import contextlib
import io
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

from depthtrack.calibration.marker_solution import solve_capture
from depthtrack.cli import main
from depthtrack.cli.measuring import calibrate_sequence
from depthtrack.files import write_atomic
from depthtrack.geometry.camera import Camera
from depthtrack.hand.pose import POSE_SIZE
from depthtrack.recording.run_folder import BACKWARD_STAGE, RunWriter
from depthtrack.recording.run_rows import RunRow
from depthtrack.recording.status import Status
from depthtrack.recording.writer import SequenceWriter

_SOLVED: dict[str, Any] = {}


def command(arguments: list[str]) -> int:
    """Run a command of depthtrack."""
    with _solved_once():
        return main(arguments)


def write_recording(arguments: list[str]) -> int:
    """Write a recording of small images: `FOLDER FRAMES`."""
    return _code(_write_recording, Path(arguments[0]), int(arguments[1]))


def write_run(arguments: list[str]) -> int:
    """Begin a run of three frames, or complete it: `FOLDER`. The backward pass replaces the first pose."""
    return _code(_write_run, Path(arguments[0]))


def write_file(arguments: list[str]) -> int:
    """Write a file of 100 KB: `FILE`."""
    return _code(write_atomic, Path(arguments[0]), "text\n" * 20_000)


def quiet(act: Callable[[list[str]], int], arguments: list[str], folder: Path) -> int:
    """Act in this process, in a folder and without output."""
    with contextlib.chdir(folder), contextlib.redirect_stdout(io.StringIO()):
        return act(arguments)


def _code(write: Callable[..., None], *arguments: Any) -> int:
    """Return the exit code that the command line gives to the end of a function."""

    def run(name: str, rest: list[str]) -> int:
        write(*arguments)
        return 0

    with mock.patch("depthtrack.cli._run", run):
        return main(["write"])


def _write_recording(folder: Path, frames: int) -> None:
    camera = Camera(16, 12, 20.0, 20.0, 8.0, 6.0, 0.001)
    with SequenceWriter(folder, camera, overwrite=True, threads=1) as writer:
        for index in range(frames):
            depth = np.full(camera.shape, 0.5 + index / 100)
            writer.append(index / 30, depth, colour=np.zeros((*camera.shape, 3), np.uint8))


def _write_run(folder: Path) -> None:
    pose = np.zeros(POSE_SIZE)
    pose[3] = 1.0
    first = RunRow(0, 0.0, Status.STARTED, 2.0, 0.9, pose + np.eye(POSE_SIZE)[0])
    resume, stages = (folder / "run.json").exists(), ("fit", BACKWARD_STAGE)
    with RunWriter(folder, {"tracker": "ik", "format": 6}, stages, resume, length=3) as run:
        for index in range(len(run.rows), 3):
            run.append(RunRow(index, index / 30, Status.TRACKED, 1.0, 0.9, pose), {"fit": 1.0})
        if not run.revised:
            run.revise({0: first}, {0: 1.0}, {0: "failed"})


@contextmanager
def _solved_once() -> Iterator[None]:
    """Measure a hand and label a capture once: what is tried is how the results are written."""
    solvers: dict[str, Callable[..., Any]] = {
        "depthtrack.cli.calibrate.calibrate_sequence": calibrate_sequence,
        "depthtrack.calibration.marker_solution.solve_capture": solve_capture,
    }
    with contextlib.ExitStack() as stack:
        for target, solve in solvers.items():
            stack.enter_context(mock.patch(target, partial(_remembered, target, solve)))
        yield


def _remembered(name: str, solve: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    if name not in _SOLVED:
        _SOLVED[name] = solve(*arguments, **options)
    return _SOLVED[name]
