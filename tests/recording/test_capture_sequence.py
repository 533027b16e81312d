"""The recording of a motion capture: a camera without images, truth in its own frame."""

import json
from pathlib import Path

import numpy as np
import pytest

from depthtrack.cli import main
from depthtrack.errors import InputError
from depthtrack.evaluation.evaluate import evaluate_run
from depthtrack.evaluation.replay import Replay
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import POSITION
from depthtrack.markers.folder.writing import write_marker_folder
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.recording import image_size, open_sequence
from depthtrack.recording.run_folder import Run
from depthtrack.viewing.run_pictures import RunPainter
from tests.support.markers import labelled_hands, true_hands

OFF = 0.004
"""Distance of the true poses from those of the run, metres."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A marker folder whose true hand is 4 mm beside the solved one."""
    labelled, out = labelled_hands(), tmp_path_factory.mktemp("markers") / "out"
    true = labelled.poses[0].copy()
    true[:, 2] += OFF
    write_marker_folder(out, labelled, truth=true_hands(labelled, true))
    return out


def test_the_recording_has_a_camera_but_no_images(folder: Path) -> None:
    recording = open_sequence(folder / "right" / "recording")
    assert not recording.has_depth
    assert not recording.has_colour
    assert len(recording) == 60
    np.testing.assert_array_equal(recording.timestamps, np.arange(60) / 120)
    frame = recording[3]
    assert not frame.depth.any()
    assert image_size(folder / "right" / "recording") == (frame.camera.width, frame.camera.height)


def test_the_camera_shows_the_whole_path_with_the_fingers_upward(folder: Path) -> None:
    replay = Replay.open(Run.load(folder / "right"))
    keypoints = HandModel(replay.hand).keypoints(replay.camera_poses)
    seen = np.isfinite(keypoints).all(axis=(1, 2))
    pixels = replay.sequence.camera.project(keypoints[seen])
    inside = (pixels > 0) & (pixels < [640, 480])
    assert inside.mean() > 0.99
    assert np.ptp(pixels, axis=(0, 1)).max() > 0.5 * 480
    upward = pixels[:, 0, 1] - pixels[:, 12, 1]
    assert np.mean(upward > 0) > 0.9


def test_poses_keep_the_frame_of_the_capture_and_pictures_move_them(folder: Path) -> None:
    replay = Replay.open(Run.load(folder / "right"))
    labelled = labelled_hands()
    np.testing.assert_array_equal(replay.run.poses, labelled.poses[0])
    pose = replay.at(0).estimate.pose
    assert pose is not None
    T = replay.sequence.T_camera_world
    np.testing.assert_allclose(pose[POSITION], T[:3, :3] @ labelled.poses[0][0, POSITION] + T[:3, 3])
    picture = RunPainter(replay, 120).picture(replay.at(0))
    assert picture.std() > 10


def test_errors_are_those_against_true_poses_and_nothing_is_segmented(folder: Path) -> None:
    evaluation = evaluate_run(folder / "right")
    values = {metric.name: metric.statistics() for metric in evaluation.metrics}
    assert values["endpoint_error_mm"]["mean"] == pytest.approx(1000 * OFF)
    assert values["angle_error_deg"]["max"] == pytest.approx(0, abs=1e-9)
    assert "e3d_mm" not in values
    assert evaluation.lost_frames == 4
    assert evaluation.ms_per_frame.statistics()["mean"] is None


def test_the_truth_of_a_part_belongs_to_its_frames(tmp_path: Path) -> None:
    whole = labelled_hands()
    part = LabelledCapture(
        whole.capture.between(30, 50),
        whole.models,
        tuple(each[30:50] for each in whole.columns),
        tuple(each[30:50] for each in whole.poses),
        tuple(each[30:50] for each in whole.confidence),
    )
    write_marker_folder(tmp_path / "out", part, truth=whole)
    truth = open_sequence(tmp_path / "out" / "right" / "recording").ground_truth
    assert truth is not None
    assert truth.poses is not None
    np.testing.assert_array_equal(truth.poses, whole.poses[0][30:50])
    assert evaluate_run(tmp_path / "out" / "right").metrics[0].statistics()["max"] == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(
    "arguments",
    [
        ["evaluate", "{run}", "--json"],
        ["evaluate", "{run}", "--report", "{out}"],
        ["video", "{run}", "-o", "{out}.mp4", "--height", "64"],
        ["view", "{run}", "--sheet", "{out}.png"],
        ["view", "{run}/recording", "--sheet", "{out}.png"],
        ["export", "{run}", "-o", "{out}.csv"],
        ["info", "{run}/recording"],
    ],
)
def test_commands_of_runs_work_on_a_run_of_markers(arguments: list[str], folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert main([part.format(run=folder / "right", out=out) for part in arguments]) == 0


def test_a_moved_folder_is_found_and_tracking_is_refused(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = tmp_path / "elsewhere"
    (folder / "right").rename(run)
    assert main(["evaluate", str(run), "--json"]) == 0
    capsys.readouterr()
    arguments = ["track", str(run / "recording"), "-o", str(tmp_path / "run"), "--config", str(run / "run.json")]
    assert main(arguments) == 2
    assert "no images to track" in capsys.readouterr().err
    run.rename(folder / "right")


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"rate": 0}, "the rate of a capture"),
        ({"frames": 10**9}, "1 to 1000000 frames"),
        ({"T_camera_world": [[1, 0, 0]]}, "rigid transform"),
        ({"T_camera_world": np.diag([1, 1, -1, 1]).tolist()}, "rigid transform"),
        ({"camera": {}}, "a camera must be"),
        ({"name": None}, None),
    ],
)
def test_a_malformed_description_is_one_sentence(
    fields: dict[str, object], message: str | None, folder: Path, tmp_path: Path
) -> None:
    known = json.loads((folder / "right" / "recording" / "capture.json").read_text())
    (tmp_path / "capture.json").write_text(json.dumps({**known, **fields}))
    if message is None:
        assert open_sequence(tmp_path).name == "None"
        return
    with pytest.raises(InputError, match=message):
        open_sequence(tmp_path)
