"""Test the command line as a whole: overview, help, errors in one sentence, exit codes."""

import subprocess
import sys
from pathlib import Path

import pytest

from depthtrack import __version__
from depthtrack.cli import COMMANDS, main

_HEAVY = ("cv2", "numba", "scipy", "trimesh", "matplotlib", "rerun", "OpenGL")


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "depthtrack", *arguments], capture_output=True, text=True, check=False)


def test_the_overview_names_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0
    text = capsys.readouterr().out
    for name, entry in COMMANDS.items():
        assert f"  {name}" in text
        assert entry.summary in text


@pytest.mark.parametrize("command", [None, *COMMANDS])
def test_help_imports_nothing_heavy(command: str | None) -> None:
    """The imported modules decide how fast `--help` is; a clock would be unreliable."""
    arguments = ["--help"] if command is None else [command, "--help"]
    code = (
        "import sys\nfrom depthtrack.cli import main\n"
        f"try:\n    main({arguments!r})\nexcept SystemExit as end:\n    assert not end.code, end.code\n"
        f"heavy = {_HEAVY!r} + (('numpy', 'tyro') if {command is None} else ())\n"
        "loaded = [name for name in heavy if name in sys.modules]\nassert not loaded, loaded"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "usage" in done.stdout


def test_unknown_commands_and_options_exit_with_2() -> None:
    for arguments in (("dance",), ("info",), ("info", "somewhere", "--no-such-option")):
        done = run(*arguments)
        assert done.returncode == 2
        assert "Traceback" not in done.stderr


def test_version() -> None:
    assert run("--version").stdout.strip() == f"depthtrack {__version__}"


def test_a_closed_output_pipe_is_no_error() -> None:
    done = subprocess.run(
        f"{sys.executable} -m depthtrack --help | head -1", shell=True, capture_output=True, text=True, check=False
    )
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("arguments", "option"),
    [
        (["demo"], "-o"),
        (["track", "{recording}"], "-o"),
        (["segment", "{recording}"], "-o"),
        (["compare", "{recording}"], "-o"),
        (["reproduce", "fig7", "--quick"], "-o"),
        (["evaluate", "{recording}"], "--report"),
    ],
)
def test_a_file_in_place_of_the_output_folder_is_rejected(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], option: str
) -> None:
    recording, file = tmp_path / "everyday", tmp_path / "file"
    assert main(["synth", "everyday", str(recording), "--frames", "1"]) == 0
    file.write_text("mine")
    assert main([part.format(recording=recording) for part in arguments] + [option, str(file)]) == 2
    assert f"{option} must be a folder, found the file {file}" in capsys.readouterr().err
    assert file.read_text() == "mine"
