"""`markers model`: rigid bodies and calibrated hands from a capture."""

import json
from pathlib import Path

import numpy as np
import pytest

from depthtrack.cli import main
from depthtrack.markers.models.marker_model import MarkerModel


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("made") / "capture"
    arguments = ["--markers", "19", "--frames", "160", "--rigid-bodies", "1"]
    assert main(["synth", "everyday", str(folder), *arguments]) == 0
    return folder


def model(*arguments: object) -> int:
    return main(["markers", "model", *map(str, arguments)])


def test_hand_is_calibrated_on_the_labels_of_the_capture(
    made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "hand.json"
    assert model(made / "truth" / "labelled.csv", "-o", out, "-m", "19", "--json") == 0
    figures = json.loads(capsys.readouterr().out)
    assert figures["labels"] == "of the capture"
    assert figures["residual_mm"] < 1 < figures["residual_before_mm"]
    found = MarkerModel.from_json(out)
    assert found.name == figures["name"] == "right"
    assert found.size_spread is not None
    assert found.hand is not None
    truth = MarkerModel.from_json(made / "truth" / "models" / "right.json").hand
    assert truth is not None
    ratio = found.hand.lengths * found.hand.scale / (truth.lengths * truth.scale)
    assert np.abs(ratio - 1).mean() < 0.05


def test_capture_without_labels_is_labelled_first(
    made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "mine.json"
    assert model(made / "capture.csv", "-o", out, "-m", "19", "--name", "mine") == 0
    text = capsys.readouterr().out
    assert "mine with 19 markers" in text
    assert "labels found" in text
    assert "hand length" in text
    truth = MarkerModel.from_json(made / "truth" / "models" / "right.json")
    found = MarkerModel.from_json(out)
    assert found.labels == truth.labels
    assert found.name == "mine"


def test_body_is_made_of_chosen_markers(made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    truth = MarkerModel.from_json(made / "truth" / "models" / "body1.json")
    labels = [f"body1:{label}" for label in truth.labels]
    for extra in ([], ["--frame", "1"]):
        assert model(made / "truth" / "labelled.csv", "-o", tmp_path / "box.json", "--body", *labels, *extra) == 0
        box = MarkerModel.from_json(tmp_path / "box.json")
        assert box.name == "box"
        assert box.is_rigid
        found, true = (np.linalg.norm(o[:, None] - o, axis=-1) for o in (box.offsets, truth.offsets))
        assert np.abs(found - true).max() < 0.003
        assert "box with 4 markers" in capsys.readouterr().out


def test_prefix_of_the_labels_is_removed(made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    labelled = (made / "truth" / "labelled.csv").read_text().replace("right:", "L-")
    (tmp_path / "named.csv").write_text(labelled)
    assert model(tmp_path / "named.csv", "-o", tmp_path / "a.json", "-m", "19", "--prefix", "L-", "--json") == 0
    assert json.loads(capsys.readouterr().out)["labels"] == "of the capture"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "either the markers of a rigid body"),
        (["-m", "19", "--body", "a"], "either the markers of a rigid body"),
        (["-m", "19", "left:13"], "one hand"),
        (["-m", "19", "--rounds", "-1"], "--rounds must be from 0"),
        (["--body", "a", "b", "c"], "no marker 'a'"),
    ],
)
def test_wrong_arguments_are_one_sentence(
    made: Path, tmp_path: Path, arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert model(made / "capture.csv", "-o", tmp_path / "x.json", *arguments) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "x.json").exists()
