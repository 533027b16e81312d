"""`depthtrack warmup` compiles what is absent, and states where the kernels are kept."""

from collections.abc import Callable
from typing import Self

import pytest

from depthtrack import compilation, kernel_list, precompilation
from depthtrack.cli import main, warmup
from depthtrack.kernel_list import Kernel


@pytest.fixture
def compiled(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the kernels that were given to processes; all kernels count as absent."""
    names: list[str] = []

    def record(kernels: list[Kernel], done: object) -> int:
        names.extend(kernel.name for kernel in kernels)
        return 3

    class Ahead:
        def __init__(self, kernels: list[Kernel]) -> None:
            record(kernels, None)

        def wait(self, seconds: float, compiled: Callable[[Kernel], None]) -> None:
            pass

        def __enter__(self) -> Self:
            return self

        def __exit__(self, *error: object) -> None:
            pass

    monkeypatch.setattr(kernel_list, "absent_kernels", list)
    monkeypatch.setattr(precompilation, "compile_kernels", record)
    monkeypatch.setattr(precompilation, "CompilationAhead", Ahead)
    return names


def compile_ahead(tracker: str = "", measures: bool = False) -> None:
    with warmup.compiled_ahead(tracker, measures) as wait:
        wait()


def test_the_kernels_are_compiled_and_their_folder_is_printed(
    compiled: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["warmup"]) == 0
    assert {"score_poses", "solve", "_incidence"} <= set(compiled)
    output = capsys.readouterr().out
    assert str(compilation.cache_folder()) in output
    assert "in 3 processes" in output


def test_a_machine_without_a_writable_folder_is_named(
    monkeypatch: pytest.MonkeyPatch, compiled: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(compilation, "cache_folder", lambda: None)
    assert main(["warmup"]) == 2
    assert not compiled
    assert "set NUMBA_CACHE_DIR" in capsys.readouterr().err


@pytest.mark.parametrize(("cores", "has_folder", "is_compiled"), [(4, True, True), (1, True, False), (4, False, False)])
def test_the_first_use_compiles_in_processes_where_that_helps(
    monkeypatch: pytest.MonkeyPatch, compiled: list[str], cores: int, has_folder: bool, is_compiled: bool
) -> None:
    monkeypatch.setattr("depthtrack.machine.usable_cores", lambda: cores)
    if not has_folder:
        monkeypatch.setattr(compilation, "cache_folder", lambda: None)
    compile_ahead()
    assert bool(compiled) == is_compiled
    assert "_incidence" not in compiled  # of synthetic sensors


def test_trackers_of_the_skin_leave_out_what_they_do_not_call(
    monkeypatch: pytest.MonkeyPatch, compiled: list[str]
) -> None:
    monkeypatch.setattr("depthtrack.machine.usable_cores", lambda: 2)
    compile_ahead("hybrid")
    assert {"fit_rounds", "score_poses"} <= set(compiled)
    assert not {"solve", "solve_each", "choose", "visible_centroid"} & set(compiled)
    compile_ahead("pso")
    assert {"solve", "solve_each", "choose", "visible_centroid"} <= set(compiled)
    assert "_rasterise" not in compiled
    compile_ahead("hybrid", measures=True)
    assert {"_rasterise", "posed_mesh"} <= set(compiled)


def test_a_few_absent_kernels_start_no_process(monkeypatch: pytest.MonkeyPatch, compiled: list[str]) -> None:
    monkeypatch.setattr(kernel_list, "absent_kernels", lambda kernels: [k for k in kernels if k.seconds < 0.2])
    compile_ahead()
    assert not compiled
