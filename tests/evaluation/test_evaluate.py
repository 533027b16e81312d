"""Test `depthtrack evaluate` on runs with known errors."""

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


def test_true_poses_have_no_error_and_small_residuals(recording: Path, tmp_path: Path) -> None:
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


def test_poses_moved_by_5_mm_have_that_error_and_larger_residuals(recording: Path, tmp_path: Path) -> None:
    # The thumb's ball of the primitives reaches 4 mm beyond the wrist, where the segmentation ends by default.
    whole: dict[str, Any] = {"format": 3, "options": {}, "segmentation": {"wrist_margin": 0.01}}
    right = evaluate_run(write_run(tmp_path / "right", recording, true_poses(recording), **whole))
    wrong = evaluate_run(write_run(tmp_path / "wrong", recording, moved(true_poses(recording), x=0.005), **whole))
    np.testing.assert_allclose(wrong.metrics[0].values, 5, atol=1e-3)
    assert [metric.statistics()["mean"] for metric in wrong.finger_errors.values()] == pytest.approx([5] * 5, abs=1e-3)
    for name, least in (("e3d_mm", 0.3), ("e2d_px", 1.0)):
        before, after = right.metric(name), wrong.metric(name)
        assert before is not None
        assert after is not None
        assert np.all(after.values > before.values + least)
    # 5 mm are 5 pixels here: the mean over a band of 5 columns beside each finger is about 3.
    e2d = wrong.metric("e2d_px")
    assert e2d is not None
    assert 2 < e2d.values.mean() < 4


def test_a_hand_10_mm_behind_its_points_has_an_e3d_of_6_to_10_mm(recording: Path, tmp_path: Path) -> None:
    evaluation = evaluate_run(write_run(tmp_path / "run", recording, moved(true_poses(recording), z=0.01)))
    e3d = evaluation.metric("e3d_mm")
    assert e3d is not None
    # A slanted surface gives less than 10.
    assert np.all((e3d.values > 6) & (e3d.values < 10))


def test_frames_without_a_pose_count_as_missed(recording: Path, tmp_path: Path) -> None:
    status = {1: "absent", 2: "lost", 5: "absent"}
    run = write_run(tmp_path / "run", recording, true_poses(recording), status)
    report = evaluate_run(run).to_json()
    assert (report["frames"], report["lost_frames"], report["absent_frames"]) == (FRAMES, 1, 2)
    assert (report["losses"], report["recovered"]) == (2, 1)
    assert report["frames_within_mm"]["10"] == pytest.approx(4 / 6)
    assert report["endpoint_error_mm"]["max"] == pytest.approx(0, abs=1e-3)
    times = open_sequence(recording).timestamps
    assert report["time_to_recovery_s"]["mean"] == pytest.approx(times[3] - times[0])


def test_annotated_joints_are_used_without_true_poses(recording: Path, tmp_path: Path) -> None:
    annotated = shutil.copytree(recording, tmp_path / "annotated")
    (annotated / "hand_poses.csv").unlink()
    run = write_run(tmp_path / "run", annotated, moved(true_poses(recording), y=0.012))
    report = evaluate_run(run, residuals=False).to_json()
    assert report["joint_error_mm"]["mean"] == pytest.approx(12, abs=1e-2)
    assert report["finger_joint_error_mm"]["ring"]["max"] == pytest.approx(12, abs=1e-2)
    assert report["frames_within_mm"] == {"10": 0, "20": 1, "30": 1, "40": 1}
    assert "endpoint_error_mm" not in report
    assert "e3d_mm" not in report


def test_without_ground_truth_the_residuals_remain(
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
    assert "losses: 1, 1 of them recovered" in text
    assert "100 % within 10 mm" in text
    assert "e3d" not in text


def test_a_moved_recording_needs_its_path(recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    here, there = shutil.copytree(recording, tmp_path / "here"), tmp_path / "there"
    run = write_run(tmp_path / "run", here, true_poses(recording))
    here.rename(there)
    assert main(["evaluate", str(run)]) == 2
    assert "is missing: give --sequence" in capsys.readouterr().err
    assert main(["evaluate", str(run), "--sequence", str(there), "--no-residuals"]) == 0


def rewritten(run: Path, **changes: Any) -> None:
    """Change entries of `run.json`; None removes an entry."""
    fields = json.loads((run / "run.json").read_text()) | changes
    (run / "run.json").write_text(json.dumps({key: value for key, value in fields.items() if value is not None}))


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"sequence": None}, "expected an entry 'sequence'"),
        ({"sequence": 5}, "expected an entry 'sequence'"),
        ({"hand": None}, "expected an entry 'hand'"),
        ({"hand": {"side": "middle"}}, "names no usable hand"),
        ({"camera": {"width": 10}}, "camera must be a JSON object"),
    ],
)
def test_malformed_run_files_are_rejected(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], changes: dict[str, Any], expected: str
) -> None:
    run = write_run(tmp_path / "run", recording, true_poses(recording)[:2])
    rewritten(run, **changes)
    assert main(["evaluate", str(run)]) == 2
    assert expected in capsys.readouterr().err


def test_times_with_compilation_print_a_hint(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = write_run(tmp_path / "run", recording, true_poses(recording))
    timings = (run / "timings.csv").read_text()
    for text, expected in ((timings, False), (timings.replace("16.000", "9000.000", 1), True)):
        (run / "timings.csv").write_text(text)
        assert main(["evaluate", str(run), "--no-residuals"]) == 0
        assert ("compile kernels: use the median" in capsys.readouterr().out) == expected


@pytest.mark.parametrize("name", ["sequence", "skin_model"])
def test_overlong_paths_are_not_printed(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    run = write_run(tmp_path / "run", recording, true_poses(recording)[:2])
    rewritten(run, **{name: "x" * 100_000})
    assert main(["evaluate", str(run)]) == 2
    message = capsys.readouterr().err
    assert f"expected a path as {name}, found 'xxx" in message
    assert message.count("x") < 120


def test_a_missing_skin_model_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
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
def test_malformed_rows_are_rejected(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, expected: str
) -> None:
    poses = true_poses(recording)[:2].copy()
    poses[:, 2] = 0.5
    run = write_run(tmp_path / "run", recording, poses)
    table = run / "poses.csv"
    table.write_text(table.read_text().replace(old, new, 1))
    assert main(["evaluate", str(run)]) == 2
    assert expected in capsys.readouterr().err


def test_a_quaternion_must_have_length_one(recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    poses = true_poses(recording)[:2].copy()
    poses[1, 3:7] *= 1.1
    assert main(["evaluate", str(write_run(tmp_path / "run", recording, poses))]) == 2
    assert "frame 1: the quaternion must have length 1, found 1.1" in capsys.readouterr().err


def test_another_recording_is_rejected(recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
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
def test_the_bounds_contain_the_whole_hand(recording: Path, skin: bool) -> None:
    camera = open_sequence(recording).camera
    surface = HandSurface.of(HandShape(), skin)
    for pose in true_poses(recording)[[0, 3]]:
        for x in (0.0, 0.25):  # in the middle of the image, and cut by its border
            there = moved(pose, x=x)
            np.testing.assert_array_equal(surface.silhouette(there, camera), surface.render(there, camera).depth > 0)
    assert surface.bounds(moved(pose, x=3.0), camera).is_empty
    assert len(visible_points(surface, moved(pose, x=3.0), camera)) == 0


def test_the_spacing_of_model_points_does_not_depend_on_distance(recording: Path) -> None:
    camera, pose = open_sequence(recording).camera, true_poses(recording)[0]
    surface = HandSurface.of(HandShape(), skin=False)
    for distance in (0.5, 2.0):
        points = visible_points(surface, moved(pose, z=distance - pose[2]), camera)
        spacing = np.asarray(cKDTree(points).query(points, k=2)[0])
        assert 1000 * np.median(spacing[:, 1]) < 1.1


def test_the_silhouette_is_that_of_the_surface_of_the_run(recording: Path, tmp_path: Path) -> None:
    """The recording shows cylinders, so the silhouette of the skin overlaps less."""
    poses = true_poses(recording)[:2]
    overlap = {}
    for model in ("cylinders", "skin"):
        run = write_run(tmp_path / model, recording, poses, tracker="ik", model=model)
        metric = evaluate_run(run).metric("silhouette_iou")
        assert metric is not None
        overlap[model] = metric.values.mean()
    assert overlap["cylinders"] > overlap["skin"] + 0.01


def test_the_keys_of_all_metrics_are_documented(recording: Path, tmp_path: Path) -> None:
    text = (Path(__file__).parents[2] / "docs" / "metrics.md").read_text()
    annotated = shutil.copytree(recording, tmp_path / "annotated")
    (annotated / "hand_poses.csv").unlink()
    poses = true_poses(recording)
    other = {"run", "recording", "tracker", "frames"}
    for place in (recording, annotated):
        run = write_run(tmp_path / f"run-{place.name}", place, poses)
        assert [key for key in evaluate_run(run).to_json() if key not in other and f"`{key}`" not in text] == []


def test_errors_on_annotated_joints_of_a_real_recording(real_data: Path, tmp_path: Path) -> None:
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
