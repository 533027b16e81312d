"""Test that all kinds of installation contain the data folders."""

import subprocess
import sys
import tarfile
from pathlib import Path

import pytest

from depthtrack.errors import InputError
from depthtrack.resources import resource_folder

ROOT = Path(__file__).parent.parent
_REPORT = (
    "from depthtrack.resources import resource_folder as f;"
    "print(f('sequences') / 'everyday.toml', f('shaders').is_dir(), sep='\\n')"
)


@pytest.fixture(scope="module")
def distributions(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with an sdist and the wheel from it."""
    folder = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", str(folder), str(ROOT)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


def installed(package: Path, folder: Path) -> list[str]:
    """Install a distribution into a folder, and return the paths of its data."""
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation"]
    subprocess.run([*pip, "--target", str(folder / "site"), str(package)], check=True, capture_output=True)
    done = subprocess.run(
        [sys.executable, "-P", "-c", _REPORT],
        cwd=folder,
        env={"PYTHONPATH": str(folder / "site")},
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.split("\n")


@pytest.mark.parametrize("pattern", ["*.whl", "*.tar.gz"])
def test_wheel_and_sdist_contain_the_data_folders(distributions: Path, tmp_path: Path, pattern: str) -> None:
    (package,) = distributions.glob(pattern)
    everyday, shaders, *_ = installed(package, tmp_path)
    assert Path(everyday).is_relative_to(tmp_path / "site")
    assert Path(everyday).is_file()
    assert shaders == "True"
    assert (tmp_path / "site" / "depthtrack" / "report" / "page" / "report.html.jinja").is_file()
    assert (tmp_path / "site" / "depthtrack" / "markers" / "models" / "layouts" / "26.json").is_file()
    assert (tmp_path / "site" / "depthtrack" / "py.typed").is_file()


def test_the_sdist_contains_the_files_to_build_and_test(distributions: Path) -> None:
    (sdist,) = distributions.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    assert {"pyproject.toml", "README.md", "LICENSE", "Makefile", "sequences/everyday.toml"} <= names
    assert {"ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md", "CITATION.cff", "mkdocs.yml"} <= names
    assert {"docs/parameters.md", "tools/generate_parameters.py"} <= names
    assert any(name.startswith("tests/") for name in names)


def test_a_checkout_uses_its_own_folders() -> None:
    assert resource_folder("sequences") == ROOT / "sequences"


def test_a_missing_folder_is_reported() -> None:
    with pytest.raises(InputError, match="reinstall"):
        resource_folder("no-such-folder")
