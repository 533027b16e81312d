"""Tracking from Python: with and without a run folder, resumed, exported."""

from pathlib import Path

import numpy as np
import pytest

import depthtrack as dt
from depthtrack.cli import main
from tests.api.conftest import FRAMES

IK = dt.tracker_config("ik", resolution=64)


def test_frames_are_yielded_with_the_poses_of_the_run(path: Path, run: dt.Run) -> None:
    frames = dt.track(dt.open_recording(path), "truth", IK, frames=2)
    poses = np.array([each.estimate.pose for each in frames])
    assert poses.tobytes() == run.poses[:2].tobytes()


def test_the_run_is_that_of_the_command(path: Path, run: dt.Run, tmp_path: Path) -> None:
    command = ["track", str(path), "-o", str(tmp_path / "run"), "--tracker", "ik", "--resolution", "64"]
    assert main([*command, "--hand", "truth"]) == 0
    for file in ("run.json", "poses.csv"):
        assert (tmp_path / "run" / file).read_bytes() == (run.folder / file).read_bytes()


def test_a_run_is_resumed(path: Path, run: dt.Run, tmp_path: Path) -> None:
    out = tmp_path / "run"
    dt.track(path, "truth", IK, out=out)
    lines = (out / "poses.csv").read_text().splitlines(keepends=True)
    (out / "poses.csv").write_text("".join(lines[:2]))
    with pytest.raises(dt.InputError, match="already holds a run"):
        dt.track(path, "truth", IK, out=out)
    again = dt.track(path, "truth", IK, out=out, resume=True)
    assert again.poses.tobytes() == run.poses.tobytes()


def test_errors_come_before_the_first_frame(path: Path, tmp_path: Path) -> None:
    with pytest.raises(dt.InputError, match="no recording"):
        dt.track(tmp_path / "nothing")
    with pytest.raises(dt.InputError, match="no tracker"):
        dt.track(path, tracker="magic")
    with pytest.raises(dt.InputError, match="start must be auto or truth"):
        dt.track(path, start="guess")  # type: ignore[call-overload]
    with pytest.raises(dt.InputError, match="whole number"):
        dt.track(path, frames=0)
    with pytest.raises(dt.InputError, match="holds no run"):
        dt.read_run(path)


def test_joints_are_returned_and_exported(run: dt.Run, tmp_path: Path) -> None:
    track = dt.joint_track(run.folder)
    assert track.keypoints.shape == (FRAMES, 21, 3)
    np.testing.assert_array_equal(track.keypoints, dt.HandModel(track.hand).keypoints(run.poses))
    written = dt.export_run(run, tmp_path / "joints.npz")
    np.testing.assert_array_equal(written.poses, run.poses)
    with np.load(tmp_path / "joints.npz") as arrays:
        assert len(arrays["timestamps"]) == FRAMES
    assert "npz" in dt.EXPORTERS


def test_recordings_open_with_named_cameras(path: Path) -> None:
    tum = dt.open_recording(path, camera="tum")
    assert tum.camera.depth_scale == 0.0002
    assert dt.open_recording(path, camera=path / "camera.json").camera == dt.open_recording(path).camera
    with pytest.raises(dt.InputError):
        dt.open_recording(path, camera="no-such-camera.json")
