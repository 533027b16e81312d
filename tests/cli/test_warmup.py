"""`depthtrack warmup` tracks with each tracker, and states where the kernels are kept."""

import pytest

from depthtrack import compilation
from depthtrack.cli import main, warmup
from depthtrack.tracking.registry import tracker_config


def test_the_kernels_are_compiled_and_their_folder_is_printed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(warmup, "SCENES", ({"model": "primitives"},))
    monkeypatch.setattr(warmup, "TRACKERS", (("ik", {"resolution": 64}),))
    layouts: list[bool] = []
    monkeypatch.setattr(warmup, "compile_layouts", lambda: layouts.append(True))
    assert main(["warmup"]) == 0
    folder = compilation.cache_folder()
    assert folder is not None
    assert str(folder) in capsys.readouterr().out
    assert layouts == [True]


def test_the_kernels_of_layouts_are_used() -> None:
    warmup.compile_layouts()


def test_each_tracker_of_the_list_exists() -> None:
    for name, options in warmup.TRACKERS:
        tracker_config(name, **options)


def test_a_machine_without_a_writable_folder_is_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(compilation, "cache_folder", lambda: None)
    monkeypatch.setattr(warmup, "compile_kernels", lambda: pytest.fail("compiled in vain"))
    assert main(["warmup"]) == 2
    assert "set NUMBA_CACHE_DIR" in capsys.readouterr().err
