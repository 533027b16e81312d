"""`depthtrack evaluate` on runs whose error is known."""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree

from depthtrack.cli import main
from depthtrack.evaluation.evaluate import evaluate_run
from depthtrack.evaluation.residuals import visible_points
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape
from depthtrack.recording import open_sequence
from depthtrack.recording.run_folder import Run
from depthtrack.rendering.hand_surface import HandSurface
from tests.support.runs import synthesise, true_poses, write_run

FRAMES = 6


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return synthesise(tmp_path_factory.mktemp("made") / "everyday", FRAMES)


def moved(poses: np.ndarray, x: float = 0, y: float = 0, z: float = 0) -> np.ndarray:
    return poses + np.array([x, y, z, *np.zeros(24)])


def test_true_poses_have_no_error_and_explain_what_is_seen(recording: Path, tmp_path: Path) -> None:
    evaluation = evaluate_run(write_run(tmp_path / "run", recording, true_poses(recording)))
    means = {metric.name: metric.statistics()["mean"] for metric in evaluation.metrics}
    for name in ("endpoint_error_mm", "largest_endpoint_error_mm", "angle_error_deg", "added_jitter_mm"):
        assert means[name] == pytest.approx(0, abs=1e-3)
    assert evaluation.success is not None
    assert evaluation.success.auc == pytest.approx(1, abs=1e-4)
    assert means["e3d_mm"] is not None
    assert means["e3d_mm"] < 0.5
    assert means["silhouette_iou"] is not None
    assert means["silhouette_iou"] > 0.95
    assert evaluation.lost_frames == 0
    assert evaluation.ms_per_frame.statistics()["median"] == 20


def test_poses_moved_by_5_mm_are_5_mm_wrong_and_stick_out(recording: Path, tmp_path: Path) -> None:
    right = evaluate_run(write_run(tmp_path / "right", recording, true_poses(recording)))
    wrong = evaluate_run(write_run(tmp_path / "wrong", recording, moved(true_poses(recording), x=0.005)))
    np.testing.assert_allclose(wrong.metrics[0].values, 5, atol=1e-3)
    assert [metric.statistics()["mean"] for metric in wrong.finger_errors.values()] == pytest.approx([5] * 5, abs=1e-3)
    for name, least in (("e3d_mm", 0.3), ("e2d_px", 1.0)):
        before, after = right.metric(name), wrong.metric(name)
        assert before is not None
        assert after is not None
        assert np.all(after.values > before.values + least)
    # 5 mm are 5 pixels here: the mean over a band of 5 columns beside each finger is about 3.
    sticking_out = wrong.metric("e2d_px")
    assert sticking_out is not None
    assert 2 < sticking_out.values.mean() < 4


def test_a_hand_10_mm_behind_its_points_has_an_e3d_of_about_that(recording: Path, tmp_path: Path) -> None:
    evaluation = evaluate_run(write_run(tmp_path / "run", recording, moved(true_poses(recording), z=0.01)))
    e3d = evaluation.metric("e3d_mm")
    assert e3d is not None
    # Less than 10 where the surface is seen at a slant.
    assert np.all((e3d.values > 6) & (e3d.values < 10))


def test_frames_without_a_pose_are_missed_not_forgotten(recording: Path, tmp_path: Path) -> None:
    status = {1: "absent", 2: "lost", 5: "absent"}
    run = write_run(tmp_path / "run", recording, true_poses(recording), status)
    report = evaluate_run(run).to_json()
    assert (report["frames"], report["lost_frames"], report["absent_frames"]) == (FRAMES, 1, 2)
    assert (report["losses"], report["recovered"]) == (2, 1)
    assert report["frames_within_mm"]["10"] == pytest.approx(4 / 6)
    assert report["endpoint_error_mm"]["max"] == pytest.approx(0, abs=1e-3)
    times = open_sequence(recording).timestamps
    assert report["time_to_recovery_s"]["mean"] == pytest.approx(times[3] - times[0])


def test_annotated_joints_are_used_where_there_are_no_true_poses(recording: Path, tmp_path: Path) -> None:
    annotated = shutil.copytree(recording, tmp_path / "annotated")
    (annotated / "hand_poses.csv").unlink()
    run = write_run(tmp_path / "run", annotated, moved(true_poses(recording), y=0.012))
    report = evaluate_run(run, residuals=False).to_json()
    assert report["joint_error_mm"]["mean"] == pytest.approx(12, abs=1e-2)
    assert report["finger_joint_error_mm"]["ring"]["max"] == pytest.approx(12, abs=1e-2)
    assert report["frames_within_mm"] == {"10": 0, "20": 1, "30": 1, "40": 1}
    assert "endpoint_error_mm" not in report
    assert "e3d_mm" not in report


def test_without_any_truth_the_label_free_metrics_remain(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    blind = shutil.copytree(recording, tmp_path / "blind")
    for name in ("hand_poses.csv", "joints.csv"):
        (blind / name).unlink()
    run = write_run(tmp_path / "run", blind, true_poses(recording))
    report = evaluate_run(run).to_json()
    assert {"e3d_mm", "e2d_px", "silhouette_iou", "jitter_mm", "ms_per_frame", "stage_ms"} <= set(report)
    assert not any("error" in key or "within" in key for key in report)
    assert main(["evaluate", str(run)]) == 0
    assert "neither true poses nor true joints" in capsys.readouterr().out


def test_the_command_prints_what_the_function_returns(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = write_run(tmp_path / "run", recording, true_poses(recording), {3: "lost"})
    assert main(["evaluate", str(run), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == evaluate_run(run).to_json()
    assert main(["evaluate", str(run), "--no-residuals"]) == 0
    text = capsys.readouterr().out
    assert "1 without a trusted pose" in text
    assert "lost 1 times, recovered 1 times" in text
    assert "100 % within 10 mm" in text
    assert "e3d" not in text


def test_a_recording_that_has_moved_is_asked_for(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    here, there = shutil.copytree(recording, tmp_path / "here"), tmp_path / "there"
    run = write_run(tmp_path / "run", here, true_poses(recording))
    here.rename(there)
    assert main(["evaluate", str(run)]) == 2
    assert "not there any more: give --sequence" in capsys.readouterr().err
    assert main(["evaluate", str(run), "--sequence", str(there), "--no-residuals"]) == 0


def rewritten(run: Path, **changes: Any) -> None:
    """`run.json` with some entries changed, or removed where None."""
    fields = json.loads((run / "run.json").read_text()) | changes
    (run / "run.json").write_text(json.dumps({key: value for key, value in fields.items() if value is not None}))


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"sequence": None}, "does not say which recording"),
        ({"sequence": 5}, "does not say which recording"),
        ({"hand": None}, "names no usable hand"),
        ({"hand": {"side": "middle"}}, "names no usable hand"),
        ({"camera": {"width": 10}}, "camera must be a JSON object"),
    ],
)
def test_runs_that_make_no_sense_are_refused(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], changes: dict[str, Any], expected: str
) -> None:
    run = write_run(tmp_path / "run", recording, true_poses(recording)[:2])
    rewritten(run, **changes)
    assert main(["evaluate", str(run)]) == 2
    assert expected in capsys.readouterr().err


def test_times_with_compilation_come_with_a_hint(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = write_run(tmp_path / "run", recording, true_poses(recording))
    timings = (run / "timings.csv").read_text()
    for text, told in ((timings, False), (timings.replace("16.000", "9000.000", 1), True)):
        (run / "timings.csv").write_text(text)
        assert main(["evaluate", str(run), "--no-residuals"]) == 0
        assert ("compile kernels: use the median" in capsys.readouterr().out) == told


@pytest.mark.parametrize("name", ["sequence", "skin_model"])
def test_absurd_paths_are_not_echoed(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    run = write_run(tmp_path / "run", recording, true_poses(recording)[:2])
    rewritten(run, **{name: "x" * 100_000})
    assert main(["evaluate", str(run)]) == 2
    message = capsys.readouterr().err
    assert f"{name} is no path: 'xxx" in message
    assert message.count("x") < 120


def test_skin_colours_that_have_moved_are_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    coloured = synthesise(tmp_path / "coloured", 2, "--background", "wall")
    run = write_run(tmp_path / "run", coloured, true_poses(coloured), skin_model=str(tmp_path / "skin.npz"))
    assert main(["evaluate", str(run)]) == 2
    assert "skin.npz" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("started", "flying", "status must be one of"),
        ("0.5", "5e200", "frame 0: a pose must be numbers up to 100"),
        ("0.5", "nan", "frame 0: a pose must be"),
    ],
)
def test_rows_that_no_tracker_writes_are_refused(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, expected: str
) -> None:
    poses = true_poses(recording)[:2].copy()
    poses[:, 2] = 0.5
    run = write_run(tmp_path / "run", recording, poses)
    table = run / "poses.csv"
    table.write_text(table.read_text().replace(old, new, 1))
    assert main(["evaluate", str(run)]) == 2
    assert expected in capsys.readouterr().err


def test_a_rotation_must_be_one(recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    poses = true_poses(recording)[:2].copy()
    poses[1, 3:7] *= 1.1
    assert main(["evaluate", str(write_run(tmp_path / "run", recording, poses))]) == 2
    assert "frame 1: the quaternion must have length 1, found 1.1" in capsys.readouterr().err


def test_another_recording_is_no_recording_of_this_run(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shorter = synthesise(tmp_path / "shorter", 3)
    run = write_run(tmp_path / "run", recording, true_poses(recording))
    capsys.readouterr()
    assert main(["evaluate", str(run), "--sequence", str(shorter)]) == 2
    assert "has 3 frames, but the run" in capsys.readouterr().err
    later = shutil.copytree(recording, tmp_path / "later")
    (later / "depth.txt").write_text(
        "".join(f"9{line}" for line in (recording / "depth.txt").read_text().splitlines(True) if line[0] != "#")
    )
    assert main(["evaluate", str(run), "--sequence", str(later)]) == 2
    assert "was taken at" in capsys.readouterr().err


@pytest.mark.parametrize("skin", [False, True])
def test_the_bounds_hold_all_of_the_hand(recording: Path, skin: bool) -> None:
    camera = open_sequence(recording).camera
    surface = HandSurface.of(HandShape(), skin)
    for pose in true_poses(recording)[[0, 3]]:
        for x in (0.0, 0.25):  # in the middle of the image, and cut by its border
            there = moved(pose, x=x)
            np.testing.assert_array_equal(surface.silhouette(there, camera), surface.render(there, camera).depth > 0)
    assert surface.bounds(moved(pose, x=3.0), camera).is_empty
    assert len(visible_points(surface, moved(pose, x=3.0), camera)) == 0


def test_points_of_the_model_are_as_fine_far_away_as_near(recording: Path) -> None:
    camera, pose = open_sequence(recording).camera, true_poses(recording)[0]
    surface = HandSurface.of(HandShape(), skin=False)
    for distance in (0.5, 2.0):
        points = visible_points(surface, moved(pose, z=distance - pose[2]), camera)
        spacing = np.asarray(cKDTree(points).query(points, k=2)[0])
        assert 1000 * np.median(spacing[:, 1]) < 1.1


def test_a_run_of_the_skin_is_held_against_the_skin(recording: Path, tmp_path: Path) -> None:
    """The silhouette of the run's own surface, not of another: thinner or thicker ones overlap less."""
    poses = true_poses(recording)[:2]
    overlap = {}
    for model in ("cylinders", "skin"):
        run = write_run(tmp_path / model, recording, poses, model=model)
        metric = evaluate_run(run).metric("silhouette_iou")
        assert metric is not None
        overlap[model] = metric.values.mean()
    assert overlap["cylinders"] > overlap["skin"] + 0.01


def test_every_metric_is_documented_with_its_key(recording: Path, tmp_path: Path) -> None:
    text = (Path(__file__).parents[2] / "docs" / "metrics.md").read_text()
    annotated = shutil.copytree(recording, tmp_path / "annotated")
    (annotated / "hand_poses.csv").unlink()
    poses = true_poses(recording)
    told = {"run", "recording", "tracker", "frames"}
    for place in (recording, annotated):
        run = write_run(tmp_path / f"run-{place.name}", place, poses)
        assert [key for key in evaluate_run(run).to_json() if key not in told and f"`{key}`" not in text] == []


def test_real_joints_of_another_skeleton(real_data: Path, tmp_path: Path) -> None:
    """A hand at the annotated joints' place, whatever its fingers do, is judged by all of them."""
    recording = real_data / "rgbd" / "open-close"
    truth = open_sequence(recording).ground_truth
    assert truth is not None
    assert truth.joints is not None
    poses = np.tile(np.array([0, 0, 0, 0, 1.0, 0, 0, *np.zeros(20)]), (5, 1))
    sequence = open_sequence(recording)
    rows = [truth.at(float(t)) for t in sequence.timestamps[:5]]
    known = [row for row in rows if row is not None]
    poses[:, :3] = truth.joints[known].mean(axis=(0, 1))
    run = write_run(tmp_path / "run", recording, poses)
    evaluation = evaluate_run(run, residuals=False)
    keypoints = HandModel(HandShape()).keypoints(Run.load(run).poses)
    distances = np.asarray(np.linalg.norm(keypoints[0] - truth.joints[known[0]], axis=-1))
    assert evaluation.metrics[0].values[0] == pytest.approx(1000 * distances.mean())
