"""Arguments of any characters end in one printable line or in work, never in a traceback."""

import os
import shutil
from pathlib import Path

import pytest

from depthtrack.cli import main
from depthtrack.errors import InputError
from depthtrack.recording import open_sequence
from depthtrack.text_table import aligned
from depthtrack.tracking.configuration import CONFIGURATIONS
from depthtrack.tracking.run import configure
from depthtrack.viewing.video import VideoWriter
from tests.support.recordings import write_sample

BAD = ("a\udcff", "a\x1b[31m", "a\nb", "a\rb", "a\x00", "a\x7f", "a\x9b31m")
"""Bytes that are not UTF-8, escapes of terminals, line breaks, and other control characters."""
GOOD = ("ö", "手", "a b", "a\u00a0b", "👨\u200d👩", "'\"$(x)`", "-", "%s", "{}")


@pytest.mark.parametrize("bad", BAD)
@pytest.mark.parametrize("name", ["info", "track", "synth", "segment", "nothing", "markers"])
def test_control_characters_are_refused_in_one_line(
    name: str, bad: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for arguments in ([name, bad], [name, "-o", bad], [bad], [name, f"--{bad}"]):
        assert main(arguments) == 2
        captured = capsys.readouterr()
        assert captured.out == ""
        (line,) = captured.err.splitlines()
        assert line.isprintable()
        assert "argument must" in line
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("good", GOOD)
def test_other_characters_are_names_of_files(
    good: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    write_sample(tmp_path / f"x{good}")
    assert main(["info", f"x{good}", "--json"]) == 0
    assert open_sequence(Path(f"x{good}")).name == f"x{good}"


@pytest.mark.parametrize("command", ["info", "track -o R", "live --source", "train-skin -o s.json", "lift S"])
def test_pipes_are_refused(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A reader would wait for the writer for ever."""
    monkeypatch.chdir(tmp_path)
    os.mkfifo("pipe")
    rest = ["-o", "R"] if command == "lift S" else []
    assert main([*command.split(), "pipe", *rest]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "write its content to a file" in line
    with pytest.raises(InputError, match="a pipe or a device"):
        open_sequence(Path("pipe"))


def test_paths_that_are_no_text_are_refused_by_the_api(tmp_path: Path) -> None:
    folder = write_sample(tmp_path / "sample")
    other = tmp_path / "sample\udcff"
    shutil.copytree(folder, other)
    sequence = open_sequence(other)
    assert len(list(sequence)) == 5
    with pytest.raises(InputError, match="path of a recording must be UTF-8") as caught:
        configure(other, sequence, CONFIGURATIONS["ik"](), sequence.hand)  # type: ignore[arg-type]
    assert str(caught.value).isprintable()
    with pytest.raises(InputError, match="path of a video must be UTF-8"):
        VideoWriter(tmp_path / "a\udcff.mp4", 30)


def test_names_in_tables_are_printable() -> None:
    lines = aligned([["name", "x"], ["a\x1b[31m\nb", "1"]], left=1)
    assert all(line.isprintable() for line in lines)
