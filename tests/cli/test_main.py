"""Test the command line as a whole: overview, help, errors in one sentence, exit codes."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from depthtrack import __version__
from depthtrack.cli import COMMANDS, main
from depthtrack.cli.markers import COMMANDS as MARKER_COMMANDS

_HEAVY = ("cv2", "numba", "scipy", "trimesh", "matplotlib", "rerun", "OpenGL")


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "depthtrack", *arguments], capture_output=True, text=True, check=False)


def test_the_overview_names_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0
    text = capsys.readouterr().out
    for name, entry in COMMANDS.items():
        assert f"  {name}" in text
        assert entry.summary in text


def test_the_overview_of_a_group_names_its_commands(capsys: pytest.CaptureFixture[str]) -> None:
    for arguments in (["markers"], ["markers", "--help"]):
        assert main(arguments) == 0
        text = capsys.readouterr().out
        assert "usage: depthtrack markers COMMAND" in text
        assert all(entry.summary in text for entry in MARKER_COMMANDS.values())
    assert main(["markers", "dance"]) == 2
    assert "no command 'dance'" in capsys.readouterr().err


@pytest.mark.parametrize("command", [None, *COMMANDS, *(f"markers {name}" for name in MARKER_COMMANDS)])
def test_help_imports_nothing_heavy(command: str | None) -> None:
    """The imported modules decide how fast `--help` is; a clock would be unreliable."""
    arguments = ["--help"] if command is None else [*command.split(), "--help"]
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


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--seed", "-1"], "seed must be"),
        (["--seed", str(2**63)], "seed must be"),
        (["--predictions"], "predictions must be"),
        (["--predictions", "nan"], "predictions must be"),
        (["--scoring.resolution", "0"], "resolution must be"),
        (["--threads", "0"], "--threads must be"),
    ],
)
def test_a_value_out_of_range_leaves_no_folder(
    arguments: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["track", str(tmp_path / "absent"), "-o", str(tmp_path / "run"), *arguments]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "run").exists()


def test_a_run_is_not_written_into_a_recording(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "depth.txt").write_text("")
    assert main(["track", str(tmp_path), "-o", str(tmp_path)]) == 2
    assert "folder of a recording" in capsys.readouterr().err


def test_an_output_below_a_file_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_text("")
    assert main(["track", str(tmp_path), "-o", str(tmp_path / "file" / "run")]) == 2
    assert f"found the file {tmp_path / 'file'}" in capsys.readouterr().err


def test_control_characters_are_escaped(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", "no\x1b[31mname\x07"]) == 2
    error = capsys.readouterr().err
    assert "\\x1b[31mname\\x07" in error
    assert "\x1b" not in error


@pytest.mark.parametrize("chosen", [None, "3"])
def test_matrices_are_multiplied_in_one_thread_unless_the_user_chose(chosen: str | None) -> None:
    variable = "OPENBLAS_NUM_THREADS"
    others = {name: value for name, value in os.environ.items() if name != variable}
    code = f"import os; from depthtrack.cli import main; main(['info', 'absent']); print(os.environ['{variable}'])"
    run = subprocess.run(
        [sys.executable, "-c", code],
        env=others if chosen is None else {**others, variable: chosen},
        capture_output=True,
        text=True,
        check=True,
    )
    assert run.stdout.split() == [chosen or "1"]
