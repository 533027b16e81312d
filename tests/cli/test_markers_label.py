"""`markers label` with a stand-in for the labelling: true labels in, a folder out."""

import json
from pathlib import Path

import pytest

from depthtrack.calibration import marker_solution
from depthtrack.cli import main
from depthtrack.markers.folder.reading import MarkerFolder
from depthtrack.markers.initialisation.started import StartedModels


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("made") / "capture"
    assert main(["synth", "everyday", str(folder), "--markers", "13", "--frames", "12", "--fps", "60"]) == 0
    return folder / "capture.csv"


@pytest.fixture(autouse=True)
def true_labels(capture: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    truth = MarkerFolder.load(capture.parent / "truth").labelled
    monkeypatch.setattr(marker_solution, "find_start", lambda *_, **__: StartedModels((None,)))
    monkeypatch.setattr(marker_solution, "label_from", lambda *_: truth)


def files(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def test_a_folder_is_written_with_truth_and_pictures(
    capture: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert main(["markers", "label", str(capture), "-o", str(out), "-m", "13"]) == 0
    text = capsys.readouterr().out
    assert "12 frames at 60 Hz" in text
    assert "right" in text
    assert {"scene.png", "residual.png", "start.json", "markers.json"} <= {path.name for path in out.iterdir()}
    assert main(["evaluate", str(out / "right"), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["endpoint_error_mm"]["max"] == pytest.approx(0, abs=1e-9)
    configuration = MarkerFolder.load(out).contents.configuration
    assert configuration["method"] == "offline"
    assert configuration["labelling"]["offline"]["use"] is True


def test_equal_runs_have_equal_bytes_and_strict_json(
    capture: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in "ab":
        arguments = ["markers", "label", str(capture), "-o", str(tmp_path / name), "-m", "13", "--json"]
        assert main([*arguments, "--no-pictures"]) == 0
        report = json.loads(capsys.readouterr().out)
    assert files(tmp_path / "a") == files(tmp_path / "b")
    assert report["models"]["right"]["markers"] == 13
    assert not (tmp_path / "a" / "scene.png").exists()


def test_a_method_changes_the_options(capture: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    arguments = ["markers", "label", str(capture), "-o", str(out), "-m", "13", "--method", "paper", "--no-pictures"]
    assert main([*arguments, "--labelling.iterations", "7"]) == 0
    labelling = MarkerFolder.load(out).contents.configuration["labelling"]
    assert labelling["assignment"]["padded"] is True
    assert labelling["fit"]["iterations"] == 7


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "expected a model"),
        (["-m", "13", "left:13", "13"], "two models are named"),
        (["-m", "13", "--frames", "3", "99"], "--frames must be from 1 to 12"),
        (["-m", "13", "--method", "guess"], "no method 'guess'"),
        (["-m", "13", "--labelling.iterations", "0"], "iterations must be"),
        (["-m", "13", "--start", "absent.json"], "absent.json is missing"),
    ],
)
def test_a_mistake_is_one_sentence(
    arguments: list[str], message: str, capture: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["markers", "label", str(capture), "-o", str(tmp_path / "out"), *arguments]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out" / "markers.json").exists()


def test_a_folder_in_use_is_rejected(capture: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["markers", "label", str(capture), "-m", "13", "--no-pictures", "-o"]
    assert main([*arguments, str(tmp_path / "out")]) == 0
    for folder, message in ((tmp_path / "out", "already holds"), (capture, "must be a folder")):
        assert main([*arguments, str(folder)]) == 2
        assert message in capsys.readouterr().err
