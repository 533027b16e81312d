"""A command that is interrupted, terminated or cut off from its output ends in one line, and leaves nothing half."""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import IO

import pytest

from depthtrack import cli
from depthtrack.cli import main
from depthtrack.cli.ending import Terminated, terminable
from depthtrack.errors import InputError
from depthtrack.outputs import locked
from depthtrack.recording.images import write_png
from depthtrack.synthesis.generate import Synthesis, Synthesiser, write_recording
from depthtrack.types import Image

ROOT = Path(__file__).parents[2]
SIGNALS = [(signal.SIGINT, 130, "interrupted"), (signal.SIGTERM, 143, "terminated")]


def start(*arguments: str, output: int | IO[str]) -> "subprocess.Popen[str]":
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    return subprocess.Popen(
        [sys.executable, "-m", "depthtrack", *arguments],
        env={**environment, "PYTHONPATH": str(ROOT)},
        text=True,
        stdout=output,
        stderr=subprocess.PIPE,
    )


@pytest.fixture(autouse=True)
def _interruptible() -> Iterator[None]:
    """Interrupt as a terminal does: a shell starts background jobs with SIGINT ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("ending") / "recording"
    write_recording(Synthesiser(Synthesis(model="skin", frames=4)), folder)
    return folder


@pytest.mark.parametrize(("number", "code", "word"), SIGNALS)
def test_signals_end_a_command_in_one_line(
    number: int, code: int, word: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(cli, "_run", lambda name, arguments: signal.raise_signal(number))
    assert main(["info"]) == code
    assert capsys.readouterr().err == f"depthtrack info: {word}\n"
    assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL


@pytest.mark.parametrize(("number", "code", "word"), SIGNALS)
def test_a_signal_while_a_recording_is_written_leaves_nothing(
    number: int,
    code: int,
    word: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    written = []

    def interrupted(path: Path, image: Image) -> None:
        write_png(path, image)
        written.append(path)
        if len(written) == 3:
            signal.raise_signal(number)  # the handler runs in the main thread

    monkeypatch.setattr("depthtrack.recording.writer.write_png", interrupted)
    assert main(["synth", "everyday", str(tmp_path / "out"), "--frames", "20"]) == code
    assert capsys.readouterr().err == f"depthtrack synth: {word}\n"
    assert list(tmp_path.iterdir()) == []


def test_only_the_main_thread_handles_signals() -> None:
    with terminable(), pytest.raises(Terminated):
        signal.raise_signal(signal.SIGTERM)
    failed: list[BaseException] = []

    def use() -> None:
        try:
            with terminable():
                pass
        except ValueError as error:
            failed.append(error)

    thread = threading.Thread(target=use)
    thread.start()
    thread.join()
    assert failed == []


def closed_pipe() -> int:
    reader, writer = os.pipe()
    os.close(reader)
    return writer


def test_a_reader_that_needs_no_more_is_no_error() -> None:
    writer = closed_pipe()
    process = start("--help", output=writer)
    os.close(writer)
    assert (process.communicate()[1], process.returncode) == ("", 0)


def test_a_reader_that_closes_before_the_end_of_the_work_ends_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def broken(name: str, arguments: list[str]) -> int:
        raise BrokenPipeError

    monkeypatch.setattr(cli, "_run", broken)
    assert main(["demo"]) == 141
    assert capsys.readouterr().err == ""


def test_an_output_that_cannot_be_written_is_an_error() -> None:
    if not Path("/dev/full").exists():
        pytest.skip("no /dev/full")
    with open("/dev/full", "w", encoding="utf-8") as full:
        process = start("--help", output=full)
        error = process.communicate()[1]
    assert (process.returncode, error) == (2, "depthtrack --help: input or output: No space left on device\n")


@pytest.fixture
def held(tmp_path: Path) -> Iterator[Path]:
    """A folder that another process holds."""
    folder = tmp_path / "held"
    folder.mkdir()
    code = (
        "import sys\nfrom pathlib import Path\nfrom depthtrack.outputs import locked\n"
        f"with locked(Path({str(folder)!r})):\n    print('held', flush=True)\n    sys.stdin.read()"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "held\n"
    yield folder
    process.kill()
    process.communicate()


@pytest.mark.skipif(sys.platform == "win32", reason="folders cannot be locked")
def test_two_processes_do_not_write_to_one_folder(
    held: Path, recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["track", str(recording), "-o", str(held), "--hand", "truth", "--tracker", "ik"]) == 2
    assert main(["compare", str(recording), "-o", str(held), "--hand", "truth", "--trackers", "ik"]) == 2
    assert main(["segment", str(recording), "-o", str(held)]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 3
    assert all(f"another process is writing to {held}: wait until it ends" in line for line in lines)
    assert list(held.iterdir()) == []


@pytest.mark.skipif(sys.platform == "win32", reason="folders cannot be locked")
def test_a_killed_process_frees_its_folder(tmp_path: Path) -> None:
    code = (
        f"from depthtrack.outputs import locked; from pathlib import Path; import os\nlocked(Path({str(tmp_path)!r}))"
    )
    code += ".__enter__(); os.kill(os.getpid(), 9)"
    subprocess.run([sys.executable, "-c", code], env={**os.environ, "PYTHONPATH": str(ROOT)}, check=False)
    with locked(tmp_path), pytest.raises(InputError, match="another process"), locked(tmp_path):
        pass
    with locked(tmp_path):
        pass
