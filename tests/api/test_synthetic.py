"""Synthesis from Python: the same files as the command."""

from pathlib import Path

import pytest

import depthtrack as dt
from depthtrack.cli import main


def test_options_and_a_synthesis_make_the_recording_of_the_command(tmp_path: Path) -> None:
    options = dt.Synthesis("grasp", sensor="kinect1", seed=5)
    first = dt.synthesise("grasp", tmp_path / "options", sensor="kinect1", seed=5, frames=2)
    dt.synthesise(options, tmp_path / "object", frames=2)
    command = ["synth", "grasp", str(tmp_path / "command"), "--sensor", "kinect1", "--seed", "5", "--frames", "2"]
    assert main(command) == 0
    assert len(first) == 2
    files = sorted(file.relative_to(tmp_path / "options") for file in (tmp_path / "options").rglob("*.*"))
    for other in ("object", "command"):
        for file in files:
            assert (tmp_path / other / file).read_bytes() == (tmp_path / "options" / file).read_bytes(), file


def test_bad_options_and_existing_folders_are_refused(tmp_path: Path) -> None:
    with pytest.raises(dt.InputError, match="sensor"):
        dt.synthesise("everyday", tmp_path / "new", sensor="magic")
    dt.synthesise("everyday", tmp_path / "made", frames=1)
    with pytest.raises(dt.InputError, match="made"):
        dt.synthesise("everyday", tmp_path / "made", frames=1)
    assert len(dt.synthesise("everyday", tmp_path / "made", frames=2, overwrite=True)) == 2
