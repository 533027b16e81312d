"""`depthtrack warmup` compiles what is absent, and states where the kernels are kept."""

import pytest

from depthtrack import compilation, precompilation
from depthtrack.cli import main, warmup
from depthtrack.precompilation import Kernel


@pytest.fixture
def compiled(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the kernels that were given to processes; all kernels count as absent."""
    names: list[str] = []

    def record(kernels: list[Kernel], done: object) -> int:
        names.extend(kernel.name for kernel in kernels)
        return 3

    monkeypatch.setattr(precompilation, "absent_kernels", list)
    monkeypatch.setattr(precompilation, "compile_kernels", record)
    return names


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
    warmup.compile_for_first_use()
    assert bool(compiled) == is_compiled
    assert "_incidence" not in compiled  # of synthetic sensors


def test_trackers_of_the_skin_leave_out_what_they_do_not_call(
    monkeypatch: pytest.MonkeyPatch, compiled: list[str]
) -> None:
    monkeypatch.setattr("depthtrack.machine.usable_cores", lambda: 2)
    warmup.compile_for_first_use("hybrid")
    assert {"fit_rounds", "score_poses"} <= set(compiled)
    assert not {"solve", "solve_each", "choose", "visible_centroid"} & set(compiled)
    warmup.compile_for_first_use("pso")
    assert {"solve", "solve_each", "choose", "visible_centroid"} <= set(compiled)


def test_a_few_absent_kernels_start_no_process(monkeypatch: pytest.MonkeyPatch, compiled: list[str]) -> None:
    monkeypatch.setattr(precompilation, "absent_kernels", lambda kernels: [k for k in kernels if k.seconds < 0.2])
    warmup.compile_for_first_use()
    assert not compiled
