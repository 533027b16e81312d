"""Compiled kernels survive a damaged, absent or outdated cache; each case runs in processes of its own."""

import json
import os
import subprocess
import sys
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MODULE = """
from depthtrack.compilation import compiled

@compiled(nogil=True)
def double(x):
    return 2 * x
"""
SCRIPT = """
import json, warnings
with warnings.catch_warnings(record=True) as found:
    warnings.simplefilter("always")
    from depthtrack import compilation
    DIGEST
    from made_kernels import double
    value = double(21)
stats = double.stats
print(json.dumps({"value": value, "hits": sum(stats.cache_hits.values()), "folder": str(compilation.cache_folder()),
                  "warnings": [str(each.message) for each in found]}))
"""


def run(folder: Path, digest: str = "", **environment: str) -> dict[str, object]:
    """Return what a process with the kernel reports; its cache is in `folder` unless the environment states another."""
    (folder / "made_kernels.py").write_text(MODULE)
    settings = {"NUMBA_CACHE_DIR": str(folder / "cache"), **environment}
    path = os.pathsep.join([str(ROOT), str(folder)])
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT.replace("DIGEST", digest)],
        env={**os.environ, **settings, "PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    report: dict[str, object] = json.loads(done.stdout)
    assert report["value"] == 42
    return report


def files(folder: Path) -> list[Path]:
    return sorted(path for path in (folder / "cache").rglob("*") if path.is_file())


def test_compiled_code_is_kept(tmp_path: Path) -> None:
    assert run(tmp_path)["hits"] == 0
    assert {path.suffix for path in files(tmp_path)} == {".nbi", ".nbc"}
    assert run(tmp_path)["hits"] == 1


@pytest.mark.parametrize("suffix", [".nbi", ".nbc"])
@pytest.mark.parametrize("contents", ["", "cut", "garbage"])
def test_damaged_files_are_replaced(tmp_path: Path, suffix: str, contents: str) -> None:
    run(tmp_path)
    (path,) = (path for path in files(tmp_path) if path.suffix == suffix)
    whole = path.read_bytes()
    path.write_bytes({"": b"", "cut": whole[: len(whole) // 2], "garbage": b"garbage" * 9}[contents])
    assert run(tmp_path)["hits"] == 0
    assert run(tmp_path)["hits"] == 1


def test_other_sources_compile_again(tmp_path: Path) -> None:
    run(tmp_path)
    assert run(tmp_path, "compilation.source_digest = lambda file: 'other'")["hits"] == 0
    assert run(tmp_path)["hits"] == 0
    assert run(tmp_path)["hits"] == 1


def test_the_digest_covers_all_that_a_kernel_imports() -> None:
    from depthtrack.compilation import sources_of

    package = ROOT / "depthtrack"
    found = {path.relative_to(package).as_posix() for path in sources_of(package / "solver" / "closest_points.py")}
    assert found >= {"solver/closest_points.py", "simd/vectors.py", "simd/functions.py", "types.py", "compilation.py"}
    assert not any(name.startswith(("tracking", "cli", "synthesis")) for name in found)
    # Names of modules after `import`, and imports over several lines.
    found = {
        path.relative_to(package).as_posix() for path in sources_of(package / "rendering" / "raster" / "kernel.py")
    }
    assert found >= {"rendering/raster/quadrics.py", "rendering/raster/tiles.py", "simd/functions.py"}


def test_a_folder_that_cannot_be_made_is_replaced_by_a_private_one(tmp_path: Path) -> None:
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    report = run(tmp_path, NUMBA_CACHE_DIR="/dev/null/cache", TMPDIR=str(temporary))
    assert Path(str(report["folder"])).is_relative_to(temporary)
    assert report["warnings"] == []
    assert run(tmp_path, NUMBA_CACHE_DIR="/dev/null/cache", TMPDIR=str(temporary))["hits"] == 1


def test_without_any_folder_kernels_are_compiled_each_time(tmp_path: Path) -> None:
    blocked = "import tempfile; tempfile.tempdir = '/dev/null'"
    for _ in range(2):
        report = run(tmp_path, blocked, NUMBA_CACHE_DIR="/dev/null/cache")
        assert (report["hits"], report["folder"]) == (0, "None")
        assert len(report["warnings"]) == 1  # type: ignore[arg-type]


def test_a_user_without_a_home_has_a_private_folder(tmp_path: Path) -> None:
    """As in a container whose user is a number that the system does not know."""
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    unknown = (
        "import pathlib\n    def no_home(self): raise RuntimeError('Could not determine home directory.')\n"
        "    pathlib.Path.expanduser = no_home; compilation._PACKAGE = pathlib.Path('/dev/null')"
    )
    settings = {"NUMBA_CACHE_DIR": "", "XDG_CACHE_HOME": "", "TMPDIR": str(temporary)}
    assert Path(str(run(tmp_path, unknown, **settings)["folder"])).is_relative_to(temporary)


def test_two_first_runs_at_once(tmp_path: Path) -> None:
    (tmp_path / "made_kernels.py").write_text(MODULE)
    with ThreadPoolExecutor(2) as pool:
        list(pool.map(run, [tmp_path, tmp_path]))
    assert run(tmp_path)["hits"] == 1


def test_a_disabled_compiler_is_an_error_of_one_sentence(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "depthtrack", "synth", "everyday", str(tmp_path / "s"), "--frames", "1"],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode != 0
    assert "NUMBA_DISABLE_JIT" in done.stderr
    assert "Traceback" not in done.stderr


def test_the_bound_of_numba_is_that_of_the_package() -> None:
    from depthtrack.compilation import TOO_NEW

    stated = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["dependencies"]
    (numba,) = (line for line in stated if line.startswith("numba"))
    assert numba.partition("<")[2] == ".".join(map(str, TOO_NEW))


@pytest.mark.parametrize("version", ["0.69.0", "0.70.0rc1", "1.0"])
def test_a_numba_that_is_too_new_is_an_error_of_one_sentence(version: str) -> None:
    from depthtrack.compilation import check_numba
    from depthtrack.errors import DepthtrackError

    check_numba("0.68.2")
    with pytest.raises(DepthtrackError, match=rf"numba must be older than 0.69, found {version}: run  pip install"):
        check_numba(version)
