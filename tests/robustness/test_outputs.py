"""Outputs are checked before any work, on every command: nothing but a regular file is ever replaced."""

import dataclasses
import os
import stat
from collections.abc import Iterator
from importlib import import_module
from itertools import cycle
from pathlib import Path
from typing import Any, get_type_hints

import pytest

from depthtrack.cli import COMMANDS, main
from depthtrack.cli.argument_checks import Output
from depthtrack.cli.markers import COMMANDS as MARKER_COMMANDS
from depthtrack.errors import InputError
from depthtrack.outputs import check_distinct, check_file, check_folder

FILES = {
    "calibrate": ("calibrate", "absent", "-o"),
    "calibrate --picture": ("calibrate", "absent", "-o", "{new}", "--picture"),
    "train-skin": ("train-skin", "absent", "-o"),
    "export": ("export", "absent", "-o"),
    "video": ("video", "absent", "-o"),
    "view --sheet": ("view", "absent", "--sheet"),
    "view --strip": ("view", "absent", "--strip"),
    "view --video": ("view", "absent", "--video"),
    "view --rrd": ("view", "absent", "--rrd"),
    "synergies fit": ("synergies", "fit", "absent", "-o"),
    "synergies info": ("synergies", "info", "--picture"),
    "bench ik": ("bench", "ik", "--out"),
    "bench starts": ("bench", "starts", "--out"),
    "markers model": ("markers", "model", "absent", "-m", "13", "-o"),
    "markers link": ("markers", "link", "absent", "-o"),
    "markers cut": ("markers", "cut", "absent", "-o"),
    "markers shuffle": ("markers", "shuffle", "absent", "-o"),
}
FOLDERS = {
    "demo": ("demo", "absent", "-o"),
    "synth": ("synth", "everyday"),
    "segment": ("segment", "absent", "-o"),
    "track": ("track", "absent", "-o"),
    "lift": ("lift", "absent", "absent", "-o"),
    "compare": ("compare", "absent", "-o"),
    "evaluate": ("evaluate", "absent", "--report"),
    "reproduce": ("reproduce", "fig7", "-o"),
    "markers label": ("markers", "label", "absent", "-m", "13", "-o"),
    "markers solve": ("markers", "solve", "absent", "-m", "13", "-o"),
    "markers fill": ("markers", "fill", "absent", "-o"),
}


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """A folder with one of each kind that must not be replaced; the names end in what all commands accept."""
    for suffix in (".png", ".mp4", ".csv"):
        (tmp_path / f"folder{suffix}").mkdir()
        os.mkfifo(tmp_path / f"pipe{suffix}")
        (tmp_path / f"loop{suffix}").symlink_to(f"loop{suffix}")
        (tmp_path / f"device{suffix}").symlink_to("/dev/null")
    (tmp_path / "file").write_text("mine")
    return tmp_path


def snapshot(folder: Path) -> dict[str, tuple[int, int]]:
    found = {path.name: path.lstat() for path in folder.iterdir()}
    return {name: (stat.S_IFMT(each.st_mode), each.st_ino) for name, each in found.items()}


def suffix_of(command: str) -> str:
    if command in ("video", "view --video"):
        return ".mp4"
    return ".csv" if command.startswith(("markers", "export")) else ".png"


_KINDS = cycle(("folder{}", "pipe{}", "loop{}", "device{}", "missing/name{}", ".", "file/name{}"))


@pytest.mark.parametrize(("command", "kind"), [(command, next(_KINDS)) for command in FILES])
def test_a_file_to_write_is_checked_first(
    command: str, kind: str, place: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(place)
    before = snapshot(place)
    arguments = [part.format(new="new.json") for part in FILES[command]]
    assert main([*arguments, kind.format(suffix_of(command))]) == 2
    error = capsys.readouterr().err
    assert "writ" in error or "must be" in error
    assert len(error.splitlines()) == 1
    assert "absent" not in error  # the output is at fault, before the input is opened
    assert snapshot(place) == before


@pytest.mark.parametrize(("command", "kind"), [(command, next(_KINDS)) for command in FOLDERS])
def test_a_folder_to_write_is_checked_first(
    command: str, kind: str, place: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(place)
    before = snapshot(place)
    kind = kind if kind == "." else {"folder{}": "file", "missing/name{}": "loop.png/new"}.get(kind, kind)
    assert main([*FOLDERS[command], kind.format(".png")]) == 2
    error = capsys.readouterr().err
    assert len(error.splitlines()) == 1
    assert "must be" in error or "cannot be written" in error
    assert "absent" not in error
    assert snapshot(place) == before


def arguments_of(kind: type[Any]) -> Iterator[tuple[str, Any]]:
    """Yield name and annotation of all arguments of a command and of the groups in it."""
    for name, hint in get_type_hints(kind, include_extras=True).items():
        found = [each for each in types_in(hint) if dataclasses.is_dataclass(each)]
        for each in found:
            assert isinstance(each, type)
            yield from arguments_of(each)
        if not found:
            yield name, hint


def types_in(hint: Any) -> Iterator[Any]:
    yield hint
    for part in getattr(hint, "__args__", ()):
        yield from types_in(part)


def test_every_path_to_write_is_marked() -> None:
    """All paths that are no inputs have the mark that `check_arguments` reads."""
    inputs = {
        *("path", "camera", "skin_model", "sequence", "sequences", "keypoints", "config", "hand", "start", "paths"),
        *(
            "runs",
            "predictions",
            "labels",
            "truth",
            "capture",
            "recording",
            "recordings",
            "rig",
            "images",
            "masks",
            "postures",
        ),
    }
    entries = [entry for entry in (COMMANDS | MARKER_COMMANDS).values() if entry.module != "depthtrack.cli.markers"]
    marked = set()
    for entry in entries:
        module = import_module(entry.module)
        kind = module.command([])[0] if hasattr(module, "command") else module.Command
        for name, hint in arguments_of(kind):
            if Path not in types_in(hint):
                continue
            marks = [each for each in getattr(hint, "__metadata__", ()) if isinstance(each, Output)]
            assert bool(marks) != (name in inputs), f"{entry.module}: {name}"
            marked |= {entry.module} if marks else set()
    assert len(marked) >= 20


@pytest.mark.parametrize("name", ["run.json", "poses.csv"])
def test_the_files_of_a_run_are_never_replaced(tmp_path: Path, name: str) -> None:
    for file in ("run.json", "poses.csv"):
        (tmp_path / file).write_text("data")
    with pytest.raises(InputError, match="belongs to the data in its folder"):
        check_file(tmp_path / name)
    check_file(tmp_path / "joints.csv")


def test_a_link_to_a_file_is_followed(tmp_path: Path) -> None:
    from depthtrack.files import write_atomic

    (tmp_path / "target").write_text("old")
    (tmp_path / "link").symlink_to("target")
    check_file(tmp_path / "link")
    write_atomic(tmp_path / "link", "new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "target").read_text() == "new"


def test_a_file_system_that_cannot_be_written_is_named() -> None:
    """Not even the superuser can make files in /proc, whatever its permissions say."""
    if not Path("/proc/self").exists():
        pytest.skip("no /proc")
    with pytest.raises(InputError, match=r"-o: cannot write /proc/name: /proc: "):
        check_file(Path("/proc/name"))
    with pytest.raises(InputError, match=r"-o: cannot write /proc/a/b: /proc: "):
        check_folder(Path("/proc/a/b"))


def test_inputs_and_other_outputs_are_not_replaced(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a.csv").write_text("data")
    with pytest.raises(InputError, match="-o must not be the input"):
        check_distinct({"-o": tmp_path / "a.csv"}, [tmp_path / "." / "a.csv"])
    with pytest.raises(InputError, match="--sheet and --strip must differ"):
        check_distinct({"--sheet": tmp_path / "b.png", "--strip": tmp_path / "b.png"}, [])
    assert main(["markers", "cut", str(tmp_path / "a.csv"), "-o", str(tmp_path / "a.csv")]) == 2
    assert "must not be the input" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["x" * 300, "nul\0"])
def test_names_that_no_file_can_have_are_refused(tmp_path: Path, name: str) -> None:
    for check in (check_file, check_folder):
        with pytest.raises(InputError):
            check(tmp_path / name)
