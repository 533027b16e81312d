"""Test `depthtrack segment` and `train-skin` on small synthetic recordings."""

import csv
import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from depthtrack.cli import main
from depthtrack.evaluation.segmentation import summary
from depthtrack.segmentation.skin_colour import SkinColourModel

FRAMES = 16


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("made") / "room"
    options = ("--sensor", "kinect1", "--background", "room", "--frames", str(FRAMES))
    assert main(["synth", "everyday", str(folder), *options]) == 0
    return folder


def test_summary_counts_the_frames_with_a_hand() -> None:
    rows: list[dict[str, Any]] = [{"found": True, "iou": 0.5, "ms": 1.0}, {"found": False, "iou": None, "ms": 3.0}]
    report = summary(rows)
    assert report["frames_with_hand"] == 1
    assert report["mean_iou"] == 0.5
    assert report["ms_per_frame"]["median"] == 2.0
    assert summary([])["mean_iou"] is None


def test_segment_writes_video_contact_sheet_and_table(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["segment", str(recording), "-o", str(tmp_path / "out"), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["frames_with_hand"] == FRAMES
    assert report["mean_iou"] > 0.85
    with (tmp_path / "out" / "segments.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == FRAMES
    assert np.mean([float(row["iou"]) for row in rows]) == pytest.approx(report["mean_iou"])
    assert all(0.3 < float(row["centre_z"]) < 0.7 for row in rows)
    video = cv2.VideoCapture(str(tmp_path / "out" / "overlay.mp4"))
    assert round(video.get(cv2.CAP_PROP_FRAME_COUNT)) == FRAMES
    assert cv2.imread(str(tmp_path / "out" / "contact-sheet.png")) is not None
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "contact-sheet.png",
        "overlay.mp4",
        "segments.csv",
    ]


def test_a_tracker_guides_the_segmentation(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recording = tmp_path / "skin"
    options = ("--sensor", "kinect1", "--background", "room", "--model", "skin", "--frames", "24")
    assert main(["synth", "everyday", str(recording), *options]) == 0
    capsys.readouterr()
    assert main(["segment", str(recording), "-o", str(tmp_path / "out"), "--tracker", "ik", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["frames_with_hand"] == 24
    assert report["mean_iou"] > 0.95


def test_hand_sizes_need_a_tracker(recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["segment", str(recording), "-o", str(tmp_path / "out"), "--hand", "hand.json"]) == 2
    assert "--tracker" in capsys.readouterr().err


def test_depth_alone_segments_the_hand(recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["segment", str(recording), "-o", str(tmp_path / "out"), "--depth-only", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["frames_with_hand"] == FRAMES
    assert report["mean_iou"] > 0.75


def test_a_wrist_margin_keeps_more_of_the_forearm(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    areas = []
    for margin in ("0", "30"):
        folder = tmp_path / margin
        assert main(["segment", str(recording), "-o", str(folder), "--wrist-margin", margin]) == 0
        with (folder / "segments.csv").open() as file:
            areas.append(np.mean([float(row["area_px"]) for row in csv.DictReader(file)]))
    assert areas[1] > 1.02 * areas[0]


def test_options_of_the_segmentation_are_parsed(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["segment", str(recording), "-o", str(tmp_path / "out"), "--json"]
    assert main([*command, "--segmentation.farthest", "0.3"]) == 0
    assert json.loads(capsys.readouterr().out)["frames_with_hand"] == 0
    assert main([*command, "--segmentation.detection.slice-step", "0"]) == 2
    assert "slice-step must be from 0.0001" in capsys.readouterr().err


def test_a_model_trained_on_a_recording_segments_it(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = tmp_path / "skin.json"
    assert main(["train-skin", str(recording), "-o", str(model)]) == 0
    assert 0 < SkinColourModel.load(model).prior < 0.5
    capsys.readouterr()
    options = ("--skin-model", str(model), "--json")
    assert main(["segment", str(recording), "-o", str(tmp_path / "out"), *options]) == 0
    assert json.loads(capsys.readouterr().out)["mean_iou"] > 0.8


def test_training_on_folders_equals_training_on_the_recording(recording: Path, tmp_path: Path) -> None:
    assert (
        main(["train-skin", str(recording / "rgb"), str(recording / "hand_mask"), "-o", str(tmp_path / "m.json")]) == 0
    )
    from_recording = tmp_path / "r.json"
    assert main(["train-skin", str(recording), "-o", str(from_recording)]) == 0
    assert SkinColourModel.load(tmp_path / "m.json").prior == pytest.approx(SkinColourModel.load(from_recording).prior)


def test_train_skin_needs_an_output_file(recording: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as exit_info:
        main(["train-skin", str(recording)])
    assert exit_info.value.code == 2
    assert "--out" in capsys.readouterr().err


def test_errors_are_one_sentence_without_traceback(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "empty").mkdir()
    other = tmp_path / "other"
    other.mkdir()
    (other / "x.png").write_bytes(b"no picture")
    for arguments, expected in (
        (["train-skin", str(tmp_path / "empty"), str(other), "-o", str(tmp_path / "m.json")], "holds no pictures"),
        (["train-skin", str(other), str(recording / "hand_mask"), "-o", str(tmp_path / "m.json")], "no mask"),
        (["train-skin", str(other), str(other), "-o", str(tmp_path / "m.json")], "x.png"),
        (["segment", str(recording), "--wrist-margin", "9999"], "wrist-margin"),
        (["segment", str(recording), "--skin-model", str(other / "x.png"), "-o", str(tmp_path / "o")], "skin model"),
    ):
        assert main(arguments) == 2
        message = capsys.readouterr().err
        assert expected in message
        assert "Traceback" not in message
        assert not (tmp_path / "m.json").exists()
