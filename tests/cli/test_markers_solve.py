"""`markers solve` on a capture with labels."""

import json
from pathlib import Path

import pytest

from depthtrack.cli import main
from depthtrack.markers.folder.reading import MarkerFolder


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("made") / "capture"
    arguments = ["synth", "everyday", str(folder), "--markers", "26", "--frames", "30", "--fps", "60"]
    assert main(arguments) == 0
    return folder / "truth" / "labelled.csv"


def test_models_with_sizes_and_poses_are_written(
    capture: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert main(["markers", "solve", str(capture), "-o", str(out), "-m", "26", "--json", "--no-pictures"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["models"]["right"]["frames_with_pose"] == 30
    assert report["sizes"]["right"]["hand_length"]["sd_mm"] > 0
    folder = MarkerFolder.load(out)
    assert folder.contents.configuration["sizes"] == report["sizes"]
    again = ["markers", "solve", str(capture), "-m", str(out / "models" / "right.json"), "--no-calibrate"]
    assert main([*again, "--no-pictures", "-o", str(tmp_path / "again")]) == 0
    assert "30 frames" in capsys.readouterr().out


def test_labels_that_must_be_there_are_missed(
    capture: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    unlabelled = capture.parents[1] / "capture.csv"
    arguments = ["markers", "solve", str(unlabelled), "-o", str(tmp_path / "out"), "-m", "26", "--labels", "file"]
    assert main(arguments) == 2
    assert "lacks labels" in capsys.readouterr().err
