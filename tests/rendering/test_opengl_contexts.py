"""OpenGL contexts are shared and released; threads, workers and errors are handled."""

import gc
import multiprocessing
import os
import re
import subprocess
import sys
import threading
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.geometry.rectangle import Rect
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.opengl import context, opening, programs
from depthtrack.rendering.opengl.context import OpenGLError
from depthtrack.rendering.opengl.opening import open_context
from depthtrack.rendering.opengl.renderer import shared_renderer
from depthtrack.rendering.opengl.scorer import OpenGLScorer
from tests.support.opengl_views import energies_and_depth, scene


@pytest.fixture(autouse=True)
def _egl() -> None:
    try:
        open_context("egl").close()
    except OpenGLError as error:
        pytest.skip(str(error))


def resident_mb() -> float:
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def in_a_new_process(code: str, **environment: str) -> str:
    """Return the last line that a new interpreter prints."""
    kept = {name: value for name, value in os.environ.items() if name != "PYOPENGL_PLATFORM"}
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        timeout=120,
        env={**kept, "PYTHONPATH": os.pathsep.join(sys.path), **environment},
        check=True,
    )
    return done.stdout.strip().splitlines()[-1]


def living_objects(gl: Any) -> int:
    """Return the number of objects of each kind; Mesa numbers them from 1."""
    names = range(1, 2000)
    tests = gl.glIsTexture, gl.glIsFramebuffer, gl.glIsBuffer, gl.glIsProgram, gl.glIsVertexArray
    return sum(bool(exists(name)) for exists in tests for name in names)


def test_hundreds_of_scorers_leave_no_objects() -> None:
    target, poses = scene()
    counts, sizes = [], []
    for turn in range(301):
        with OpenGLScorer(HandShape(), sums="gpu" if turn % 2 else "cpu") as scorer:
            scorer.set_target(target)
            scorer.score(poses)
        if turn in (50, 300):
            with shared_renderer("egl").context as gl:
                counts.append(living_objects(gl))
            sizes.append(resident_mb())
    assert counts[0] == counts[1] > 0
    assert sizes[1] - sizes[0] < 8


def test_a_scorer_that_is_not_closed_frees_its_texture() -> None:
    scorer = OpenGLScorer(HandShape(), sums="gpu")
    scorer.set_target(scene()[0])
    shared, (texture,) = shared_renderer("egl"), scorer._textures
    with shared.context as gl:
        assert gl.glIsTexture(texture)
    del scorer
    gc.collect()
    with shared.context as gl:
        assert not gl.glIsTexture(texture)


def test_a_closed_scorer_raises_an_error() -> None:
    scorer = OpenGLScorer(HandShape())
    scorer.set_target(scene()[0])
    scorer.close()
    scorer.close()
    with pytest.raises(RuntimeError, match="closed"):
        scorer.score(scene()[1])


def test_scorers_used_in_turn_do_not_interact() -> None:
    """Scorers of different hands, sizes and sums give the scores that each gives alone."""
    (target, poses), (other, _) = scene(0), scene(1)
    small = other.crop(Rect.of_size(10, 5, 30, 33))
    alone = []
    for shape, seen, sums in ((HandShape(), target, "cpu"), (HandShape(side="left", scale=1.2), small, "gpu")):
        with OpenGLScorer(shape, sums=sums) as scorer:  # type: ignore[arg-type]
            scorer.set_target(seen)
            alone.append(scorer.score(poses))
    first, second = OpenGLScorer(HandShape(), sums="cpu"), OpenGLScorer(HandShape(side="left", scale=1.2), sums="gpu")
    with first, second:
        first.set_target(target)
        second.set_target(small)
        for _ in range(3):
            np.testing.assert_array_equal(first.score(poses), alone[0])
            np.testing.assert_array_equal(second.score(poses), alone[1])
    assert np.abs(alone[0] - alone[1]).min() > 0.1


def test_threads_give_equal_scores() -> None:
    target, poses = scene()
    results: dict[int, np.ndarray] = {}

    def work(index: int) -> None:
        with OpenGLScorer(HandShape(), sums="gpu" if index % 2 else "cpu") as scorer:
            scorer.set_target(target)
            results[index] = np.stack([scorer.score(poses) for _ in range(10)])

    threads = [threading.Thread(target=work, args=(index,)) for index in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(results) == 4
    for index, energies in results.items():
        np.testing.assert_array_equal(energies, np.broadcast_to(results[index % 2][0], energies.shape))


def test_no_context_stays_current_after_a_call() -> None:
    """Other EGL code in this process keeps its own current context."""
    from OpenGL import EGL  # the module under test has bound PyOpenGL to EGL

    assert not EGL.eglGetCurrentContext()
    outer = open_context("egl")
    with outer as gl:
        name = int(gl.glGenTextures(1))
        gl.glBindTexture(gl.GL_TEXTURE_2D, name)
        target, poses = scene()
        with OpenGLScorer(HandShape()) as scorer:
            scorer.set_target(target)
            scorer.score(poses)
        assert int(gl.glGetIntegerv(gl.GL_TEXTURE_BINDING_2D)) == name
    outer.close()
    assert not EGL.eglGetCurrentContext()


def test_closed_contexts_are_rejected_and_new_ones_work() -> None:
    target, poses = scene()
    scorer = OpenGLScorer(HandShape())
    scorer.set_target(target)
    before = scorer.score(poses)
    shared_renderer("egl").context.close()
    with pytest.raises(OpenGLError, match="released"):
        scorer.score(poses)
    scorer.close()
    with OpenGLScorer(HandShape()) as fresh:
        fresh.set_target(target)
        np.testing.assert_array_equal(fresh.score(poses), before)


def test_spawned_workers_give_equal_scores() -> None:
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as pool:
        workers = list(pool.map(energies_and_depth, ["egl", "egl"], [4, 4]))
    for energies, depth in workers:
        np.testing.assert_array_equal(energies, energies_and_depth("egl", 4)[0])
        np.testing.assert_array_equal(depth, energies_and_depth("egl", 4)[1])


def test_a_forked_child_raises_an_error_and_does_not_hang() -> None:
    code = """
import os
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.opengl.scorer import OpenGLScorer
from tests.support.opengl_views import scene
scorer = OpenGLScorer(HandShape())
target, poses = scene()
scorer.set_target(target)
scorer.score(poses)
read, write = os.pipe()
if os.fork() == 0:
    said = []
    for action in (lambda: scorer.score(poses), lambda: OpenGLScorer(HandShape())):
        try:
            action()
        except Exception as error:
            said.append(str(error))
    scorer.close()
    os.write(write, " | ".join(said).encode())
    os._exit(0)
os.wait()
print(os.read(read, 4096).decode())
"""
    said = in_a_new_process(code).split(" | ")
    assert len(said) == 2
    assert all("fork" in words and "spawn" in words for words in said)


def test_a_second_platform_in_one_process_is_rejected() -> None:
    with pytest.raises(OpenGLError, match="already uses OpenGL through egl"):
        OpenGLScorer(HandShape(), platform="osmesa")


def test_a_contradicting_variable_is_rejected_and_ours_is_restored() -> None:
    code = """
from depthtrack.errors import DepthtrackError
from depthtrack.rendering.opengl.opening import open_context
try:
    open_context("egl")
except DepthtrackError as error:
    print(error)
"""
    assert "PYOPENGL_PLATFORM=glx contradicts the egl backend" in in_a_new_process(code, PYOPENGL_PLATFORM="glx")
    assert "PYOPENGL_PLATFORM" not in os.environ


@pytest.mark.parametrize(
    ("platform", "package"), [("egl", "libegl1 libgl1-mesa-dri libopengl0"), ("osmesa", "libosmesa6")]
)
def test_a_missing_library_names_its_package(
    platform: context.Platform, package: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(opening, "_loads", lambda name: False)
    monkeypatch.setattr(opening, "_refuse_contradictions", lambda platform: None)
    with pytest.raises(OpenGLError, match=f"apt-get install {package}"):
        open_context(platform)


@pytest.mark.parametrize("device", ["software", "gpu"])
def test_devices_are_chosen_by_kind(device: Literal["software", "gpu"]) -> None:
    """A machine has one kind of renderer or both; the kind that it lacks is named in the error."""
    is_default = OpenGLScorer(HandShape()).software == (device == "software")
    missing = ""
    try:
        with OpenGLScorer(HandShape(), device=device) as scorer:
            assert scorer.software == (device == "software")
    except OpenGLError as error:
        missing = str(error)
    assert not missing or (not is_default and re.search(r"EGL finds no (GPU|software renderer); tried .+: ", missing))


def test_devices_that_do_not_exist_are_rejected() -> None:
    with pytest.raises(OpenGLError, match=r"no device 99: choose one of"):
        OpenGLScorer(HandShape(), device=99)
    with pytest.raises(OpenGLError, match="in software only"):
        OpenGLScorer(HandShape(), platform="osmesa", device="gpu")


def test_invalid_options_are_rejected() -> None:
    with pytest.raises(InputError, match="'egl' or 'osmesa', found 'glx'"):
        OpenGLScorer(HandShape(), platform="glx")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="'gpu' or 'cpu', found 'tpu'"):
        OpenGLScorer(HandShape(), sums="tpu")  # type: ignore[arg-type]


def test_a_shader_that_the_driver_rejects_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "cover.vert").write_text("#version 330 core\nvoid main() { nonsense; }\n")
    monkeypatch.setattr(programs, "resource_folder", lambda name: tmp_path)
    with shared_renderer("egl").context as gl, pytest.raises(OpenGLError, match=r"shaders/cover\.vert.*nonsense"):
        programs.Program(gl, "cover.vert", "compare.frag")


def test_opengl_is_imported_at_its_first_use_only() -> None:
    code = """
import sys
import depthtrack.rendering.backends, depthtrack.rendering.opengl.scorer, depthtrack.rendering.doctor
print(sorted(name for name in sys.modules if name.split(".")[0] == "OpenGL"))
"""
    assert in_a_new_process(code) == "[]"


def test_the_code_of_a_driver_error_is_reported() -> None:
    shared = shared_renderer("egl")
    with pytest.raises(OpenGLError, match="failed with OpenGL error 1280"), shared.context as gl:
        gl.glEnable(0xBAD)
    with shared.context as gl:
        assert gl.glGetError() == 0
