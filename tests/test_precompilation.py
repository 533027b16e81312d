"""The list of kernels is right, and processes compile them into one folder without harm."""

import inspect
import json
import os
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import pytest
from numba import types
from numba.core.dispatcher import Dispatcher

from depthtrack import kernel_processes
from depthtrack.compilation import _Files
from depthtrack.kernel_list import Kernel, listed_kernels, text_of, type_of
from depthtrack.precompilation import PartsFirst, compile_kernels

ROOT = Path(__file__).parents[1]
SMALL = """
from depthtrack.kernel_list import absent_kernels, listed_kernels
from depthtrack.precompilation import compile_kernels
kernels = [kernel for kernel in listed_kernels() if kernel.name in {"is_complete", "submit", "limit_gradients"}]
assert absent_kernels(kernels) == kernels
shown = []
processes = compile_kernels(kernels, lambda kernel: shown.append(kernel.name))
assert sorted(shown) == sorted(kernel.name for kernel in kernels), shown
assert processes >= 1
assert not absent_kernels(kernels)
kernels[0].dispatcher.compile(kernels[0].signature)
assert sum(kernels[0].dispatcher.stats.cache_hits.values()) == 1
"""
POSES = """
import sys
import numpy as np
from depthtrack.hand.compiled_tangent import retract, retract_rows
from depthtrack.kernel_list import listed_kernels
from depthtrack.precompilation import compile_kernels
if "ahead" in sys.argv:
    compile_kernels([kernel for kernel in listed_kernels() if kernel.name == "retract_rows"])
poses, steps = np.random.default_rng(0).normal(size=(2, 50, 27))
moved = np.empty_like(poses)
retract_rows(poses, np.ascontiguousarray(steps[:, :26]), moved)
assert sum(retract_rows.stats.cache_hits.values()) == ("ahead" in sys.argv)
row = np.empty(27)
retract(poses[0], steps[0, :26], row)  # a part of the kernel, whose code has no entry from Python
assert np.array_equal(row, moved[0])
sys.stdout.buffer.write(moved.tobytes())
"""
WAITING = """
import numpy as np
from depthtrack.kernel_list import absent_kernels, listed_kernels
from depthtrack.precompilation import CompilationAhead
from depthtrack.solver.swarm import keep_lowest
kernels = [kernel for kernel in listed_kernels() if kernel.name in {"keep_lowest", "score_poses"}]
with CompilationAhead(kernels) as running:
    (kernel,) = [kernel for kernel in kernels if kernel.name == "keep_lowest"]
    keep_lowest.compile(kernel.signature)
    assert sum(keep_lowest.stats.cache_hits.values()) == 1
    running.wait(5.0)
assert [kernel.name for kernel in absent_kernels(kernels)] == ["score_poses"]  # it was cut short
"""
WITHOUT_SHORTCUTS = """
import subprocess
import sys
from subprocess import PIPE
from depthtrack import kernel_processes
from depthtrack.kernel_list import absent_kernels, listed_kernels
from depthtrack.precompilation import compile_kernels
start_for, failed = kernel_processes.start_for, []
def start(kernels):
    if kernels is None:
        return start_for(None)
    failed.append(kernels)
    return subprocess.Popen([sys.executable, "-c", ""], stdin=PIPE, stdout=PIPE, text=True)
kernel_processes.start_for = start
kernels = [kernel for kernel in listed_kernels() if kernel.name in {"is_complete", "submit", "limit_gradients"}]
compile_kernels(kernels)
assert len(absent_kernels(kernels)) == len(failed)
"""


@pytest.mark.parametrize("kernel", listed_kernels(), ids=lambda kernel: kernel.name)
def test_each_listed_kernel_takes_these_arguments(kernel: Kernel) -> None:
    assert isinstance(kernel.dispatcher, Dispatcher), "run  python tools/generate_kernels.py"
    inspect.signature(kernel.dispatcher.py_func).bind(*kernel.signature)
    assert [text_of(each) for each in kernel.signature] == kernel.arguments


@pytest.mark.parametrize("kernel", listed_kernels(), ids=lambda kernel: kernel.name)
def test_each_listed_kernel_returns_plain_values(kernel: Kernel) -> None:
    """numba would make an object by a call of Python, and crash if a signal raises an error there."""

    def is_plain(kind: Any) -> bool:
        if isinstance(kind, types.BaseAnonymousTuple):
            return all(map(is_plain, kind))
        return isinstance(kind, types.Array | types.Number | types.Boolean) or kind == types.none

    kernel.dispatcher.compile(kernel.signature)
    assert is_plain(kernel.dispatcher.overloads[kernel.signature].signature.return_type)


def test_an_unknown_type_is_rejected() -> None:
    for text in ("print", "float64[9", "Array"):
        with pytest.raises(ValueError, match="no type"):
            type_of(text)


def test_processes_compile_what_is_absent(tmp_path: Path) -> None:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", SMALL], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_a_process_that_fails_is_followed_by_one_without_shortcuts(tmp_path: Path) -> None:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT_SHORTCUTS], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


def test_kernels_that_are_compiled_ahead_return_the_same_bits(tmp_path: Path) -> None:
    moved = []
    for when in ("ahead", "here"):
        environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / when), "PYTHONPATH": str(ROOT)}
        done = subprocess.run([sys.executable, "-c", POSES, when], env=environment, capture_output=True, check=False)
        assert done.returncode == 0, done.stderr
        moved.append(done.stdout)
    assert moved[0] == moved[1]


def test_processes_that_fail_leave_their_kernels_to_the_first_use(monkeypatch: pytest.MonkeyPatch) -> None:
    def start(kernels: object) -> "subprocess.Popen[str]":
        return subprocess.Popen([sys.executable, "-c", ""], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    monkeypatch.setattr(kernel_processes, "start_for", start)
    shown: list[Kernel] = []
    compile_kernels(listed_kernels()[:3], shown.append)
    assert len(shown) == 3


def test_a_call_waits_for_its_kernel(tmp_path: Path) -> None:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", WAITING], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_each_kernel_follows_its_parts() -> None:
    kernels = listed_kernels()
    waiting, names, running = PartsFirst(kernels), list[str](), list[int]()
    while (number := waiting.take()) is not None:
        names.append(kernels[number].name)
        waiting.finish(number)
    assert sorted(names) == sorted(kernel.name for kernel in kernels)
    place = {name: n for n, name in enumerate(names)}
    assert place["forward_kinematics"] < place["solve"] < place["fit_rounds"]
    assert place["match_points"] < place["fit_rounds"]
    assert place["fit_rounds"] < place["score_poses"]
    # While a part is compiled, other processes take kernels without it.
    waiting = PartsFirst([kernel for kernel in kernels if kernel.name in {"match_points", "fit_rounds", "submit"}])
    running = [number for _ in range(2) if (number := waiting.take()) is not None]
    assert len(running) == 2
    waiter = threading.Thread(target=lambda: running.append(waiting.take() or 0))
    waiter.start()
    for number in running[:2]:
        waiting.finish(number)
    waiter.join(10)
    assert len(set(running)) == 3


def test_a_kernel_that_is_waited_for_comes_next_with_its_parts() -> None:
    kernels = [kernel for kernel in listed_kernels() if kernel.name in {"score_poses", "submit", "solve", "fit_rounds"}]
    number = {kernel.name: n for n, kernel in enumerate(kernels)}
    waiting = PartsFirst(kernels)
    waiting.hurry(number["submit"])
    assert waiting.take() == number["submit"]
    waiting.hurry(number["fit_rounds"])
    assert waiting.take() == number["solve"]
    waiting.finish(number["solve"])
    assert waiting.take() == number["fit_rounds"]
    waiting.hurry(number["submit"])  # it is taken already
    assert waiting.take() == number["score_poses"]


def test_no_kernel_is_taken_after_a_stop() -> None:
    waiting = PartsFirst(listed_kernels())
    waiting.stop()
    assert waiting.take() is None


def test_signatures_that_two_processes_save_at_once_stay_apart(tmp_path: Path) -> None:
    one, other = (_Files(str(tmp_path), "kernel", "stamp") for _ in range(2))
    other._load_index = dict  # it has read the index before `one` wrote it
    one.save("first", "code of the first")
    other.save("second", "code of the second")
    assert other._load_data("kernel." + one_name(tmp_path, "first")) == "code of the first"
    reader = _Files(str(tmp_path), "kernel", "stamp")
    assert reader.load("second") == "code of the second"
    assert reader.load("first") in (None, "code of the first")


def one_name(folder: Path, key: str) -> str:
    """Return the end of the name of the file that holds the code of a key."""
    (name,) = (path.name for path in folder.glob("*.nbc") if key.encode() in path.read_bytes())
    return name.removeprefix("kernel.")


@pytest.mark.slow
def test_all_kernels_that_are_called_are_listed() -> None:
    command = [sys.executable, str(ROOT / "tools" / "generate_kernels.py"), "--print"]
    # What a process compiles for others is loaded by none: only the second one states what Python calls.
    _, called = (json.loads(subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout) for _ in range(2))
    listed = {(kernel.module, kernel.name, json.dumps(kernel.arguments)) for kernel in listed_kernels()}
    absent = {(module, name, text) for module, name, text, _, is_called in called if is_called} - listed
    assert not absent, "run  python tools/generate_kernels.py"
