"""A library that cannot be imported gives one sentence with the command that mends it."""

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from depthtrack.cli.broken_imports import LIBRARIES, broken_imports

ROOT = Path(__file__).parents[2]
REASON = "libGL.so.1: cannot open shared object file: No such file or directory"


def run(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join([str(folder), str(ROOT)])
    return subprocess.run(
        [sys.executable, "-m", "depthtrack", *arguments],
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize("command", [["info", "S"], ["doctor"], ["synth", "everyday", "OUT", "--frames", "1"]])
def test_a_broken_library_is_named(tmp_path: Path, command: list[str]) -> None:
    (tmp_path / "cv2.py").write_text(f"raise ImportError({REASON!r})")
    done = run(tmp_path, *command)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert f"cv2 cannot be imported ({REASON})" in done.stderr
    assert "pip install opencv-python-headless" in done.stderr


def test_a_missing_library_is_named(tmp_path: Path) -> None:
    (tmp_path / "sitecustomize.py").write_text("import sys; sys.modules['cv2'] = None")
    done = run(tmp_path, "info", "S")
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert "cv2 cannot be imported" in done.stderr


def test_all_required_libraries_are_tried() -> None:
    """The list is that of the package's own requirements."""
    stated = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["dependencies"]
    assert {line.partition(">")[0] for line in stated} == set(LIBRARIES.values())
    assert broken_imports() == {}
