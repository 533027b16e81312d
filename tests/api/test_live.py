"""Pushed frames: the same bits as the command, and checks of what is pushed."""

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import depthtrack as dt
from depthtrack.cli import main
from depthtrack.hand.size_parameters import COUNT, measures
from depthtrack.recording.keypoints import HEADER, keypoint_cells
from depthtrack.tracking.configuration import CONFIGURATIONS
from depthtrack.tracking.pipeline import NoTracker
from depthtrack.tracking.tracker import Estimate

CAMERA = dt.Camera(32, 24, 30.0, 30.0, 15.5, 11.5, 0.0002)
DEPTH = np.full(CAMERA.shape, 0.5, np.float32)
COLOUR = np.zeros((*CAMERA.shape, 3), np.uint8)


def blind(**options: Any) -> dt.HandTracker:
    """Return a tracker that finds nothing."""
    return dt.HandTracker(CAMERA, tracker=NoTracker(), **options)


@pytest.mark.parametrize("name", [name for name in CONFIGURATIONS if name != "lift"])
def test_pushed_frames_give_the_bits_of_the_command(path: Path, tmp_path: Path, name: str) -> None:
    command = ["track", str(path), "-o", str(tmp_path / "run"), "--tracker", name, "--threads", "1"]
    assert main([*command, "--hand", "average", "--side", "right"]) == 0
    run = dt.read_run(tmp_path / "run")
    recording = dt.open_recording(path)
    with dt.HandTracker(recording.camera, "average", name, deadline=None) as tracker:
        for frame, pose, energy, status in zip(recording, run.poses, run.energy, run.status, strict=True):
            estimate = tracker.update(frame.depth, frame.colour, timestamp=frame.timestamp)
            assert estimate.status is status
            assert estimate.pose is not None
            assert estimate.pose.tobytes() == pose.tobytes()
            assert estimate.energy == energy


def test_pushed_keypoints_give_the_bits_of_their_file(path: Path, tmp_path: Path) -> None:
    recording, config = dt.open_recording(path), dt.tracker_config("lift", resolution=64)
    truth, file = recording.ground_truth, tmp_path / "keypoints.csv"
    assert truth is not None
    assert truth.joints is not None
    pixels = recording.camera.project(truth.joints).round(3)
    found = [dt.ImageKeypoints(each, np.where(np.arange(21) == 3, 0.25, 0.9)) for each in pixels]
    cells = [[str(time), *keypoint_cells(each)] for time, each in zip(recording.timestamps, found, strict=True)]
    file.write_text("\n".join(",".join(row) for row in [list(HEADER), *cells]) + "\n")
    run = dt.track(recording, dt.HandShape(), config, out=tmp_path / "run", keypoints=file)
    with dt.HandTracker(recording.camera, "average", config) as tracker:
        for frame, keypoints, pose in zip(recording, found, run.poses, strict=True):
            rows = np.column_stack([keypoints.pixels, keypoints.confidence])
            estimate = tracker.update(frame.depth, frame.colour, timestamp=frame.timestamp, keypoints=rows)
            assert estimate.pose is not None
            assert estimate.pose.tobytes() == pose.tobytes()


@pytest.mark.parametrize(
    ("keypoints", "message"),
    [
        (np.zeros((20, 3)), "x, y and confidence of 21 points"),
        (np.full((21, 3), 2.0), "between 0 and 1"),
        (dt.ImageKeypoints(np.zeros((21, 3)), np.zeros(21)), r"\(21, 2\) pixels"),
    ],
)
def test_malformed_keypoints_are_rejected(keypoints: Any, message: str) -> None:
    with blind() as tracker, pytest.raises(dt.InputError, match=message):
        tracker.update(DEPTH, timestamp=0.0, keypoints=keypoints)


def test_without_colour_the_bits_are_those_of_a_recording_without_colour(path: Path, tmp_path: Path) -> None:
    shutil.copytree(path, tmp_path / "grey")
    (tmp_path / "grey" / "rgb.txt").unlink()
    config, recording = dt.tracker_config("ik", resolution=64), dt.open_recording(path)
    expected = [each.estimate.pose for each in dt.track(tmp_path / "grey", dt.HandShape(), config)]
    with dt.HandTracker(recording.camera, "average", config) as tracker:
        found = [tracker.update(frame.depth, timestamp=frame.timestamp).pose for frame in recording]
    np.testing.assert_array_equal(found, expected)


def test_without_a_hand_the_average_right_one_is_tracked_first(path: Path) -> None:
    recording, config = dt.open_recording(path), dt.tracker_config("ik", resolution=64)
    found = dict[str | None, list[Any]]()
    for hand in (None, "average"):
        with dt.HandTracker(recording.camera, hand, config) as tracker:
            found[hand] = [tracker.update(each.depth, each.colour, timestamp=each.timestamp).pose for each in recording]
            assert tracker.side_sure == (hand is not None)
            assert (tracker.hand, tracker.measured) == (dt.HandShape(), {})
    np.testing.assert_array_equal(found[None], found["average"])


@pytest.mark.slow
def test_a_left_hand_of_other_sizes_is_measured_while_it_is_tracked(tmp_path: Path) -> None:
    """Ten frames a second, without colour or room, take a tenth of the time."""
    hand, config = dt.HandShape(side="left", scale=0.85), dt.tracker_config("ik", resolution=64)
    recording = dt.synthesise("everyday", tmp_path / "left", model="skin", hand=hand, rate=10.0, frames=75)
    truth, errors, hands = recording.ground_truth, list[float](), list[dt.HandShape]()
    assert truth is not None
    with dt.HandTracker(recording.camera, tracker=config) as tracker:
        for frame in recording:
            estimate = tracker.update(frame.depth, timestamp=frame.timestamp)
            keypoints = truth.keypoints_at(frame.timestamp)
            assert keypoints is not None
            assert estimate.hand is not None
            errors.append(1000 * float(np.linalg.norm(tracker.keypoints(estimate) - keypoints, axis=1).mean()))
            hands.append(estimate.hand)
        assert tracker.side_sure
        assert tracker.hand.side == "left"
        length = tracker.measured["hand_length"]
    average_mm = 1000 * measures(np.zeros(COUNT))["hand_length"][0]
    assert abs(length.mm - 0.85 * average_mm) < 3 * length.sigma_mm < 0.1 * length.mm
    assert len(set(hands)) >= 3
    assert np.median(errors[-14:]) < 5 < np.median(errors[:30])


def test_keypoints_are_those_of_the_hand_that_an_estimate_was_made_with() -> None:
    pose, hand = np.array([0, 0, 0.5, 1, *np.zeros(23)]), dt.HandShape(side="left", scale=0.9)
    with blind() as tracker:
        estimate = Estimate(pose, 1.0, 0.9, dt.Status.TRACKED, hand=hand)
        np.testing.assert_array_equal(tracker.keypoints(estimate), dt.HandModel(hand).keypoints(pose))
        of_given = dt.HandModel(dt.HandShape()).keypoints(pose)
        np.testing.assert_array_equal(tracker.keypoints(replace(estimate, hand=None)), of_given)


def test_a_tracker_of_your_own_keeps_its_hand() -> None:
    with blind() as tracker:
        tracker.update(DEPTH, timestamp=0)
        assert (tracker.hand, tracker.side_sure, tracker.measured) == (dt.HandShape(), True, {})


def test_stored_units_and_doubles_mean_the_same_as_metres(path: Path) -> None:
    recording = dt.open_recording(path)
    camera, frame = recording.camera, recording[0]
    units = np.rint(frame.depth / camera.depth_scale).astype(np.uint16)
    assert camera.metres(units).tobytes() == frame.depth.tobytes()
    poses = []
    for depth in (frame.depth, units, frame.depth.astype(np.float64)):
        with dt.HandTracker(camera, "average", dt.tracker_config("ik", resolution=64)) as tracker:
            poses.append(tracker.update(depth, timestamp=0.0).pose)
    assert poses[0] is not None
    assert all(pose is not None and pose.tobytes() == poses[0].tobytes() for pose in poses)


def test_keypoints_and_observation_of_the_last_frame(path: Path) -> None:
    recording = dt.open_recording(path)
    frame, truth = recording[0], recording.ground_truth
    assert truth is not None
    assert truth.poses is not None
    options = {"hand": dt.HandShape(), "start_pose": truth.poses[0]}
    with dt.HandTracker(recording.camera, tracker=dt.tracker_config("ik", resolution=64), **options) as tracker:
        estimate = tracker.update(frame.depth, frame.colour, timestamp=12.5)
        assert estimate.status is dt.Status.STARTED
        assert tracker.observation is not None
        assert tracker.observation.timestamp == 12.5
        true_keypoints = dt.HandModel(dt.HandShape()).keypoints(truth.poses[0])
        assert np.linalg.norm(tracker.keypoints(estimate) - true_keypoints, axis=1).mean() < 0.005


def test_a_frame_without_a_hand_has_no_pose() -> None:
    with blind() as tracker:
        estimate = tracker.update(np.zeros_like(DEPTH), timestamp=0)
        assert (estimate.pose, estimate.status) == (None, dt.Status.ABSENT)
        assert np.isnan(tracker.keypoints(estimate)).all()
        assert tracker.observation is None


@pytest.mark.parametrize(
    ("depth", "colour", "timestamp", "expected"),
    [
        (DEPTH.T, None, 2, "camera's shape"),
        (DEPTH.astype(np.int32), None, 2, "uint16"),
        (np.where(DEPTH > 0, np.nan, DEPTH), None, 2, "finite"),
        (np.where(DEPTH > 0, np.inf, DEPTH), None, 2, "finite"),
        (-DEPTH, None, 2, "not negative"),
        (DEPTH, COLOUR[..., :1], 2, "uint8 RGB"),
        (DEPTH, COLOUR.astype(np.float32), 2, "uint8 RGB"),
        (DEPTH, None, 1, "must increase"),
        (DEPTH, None, float("nan"), "finite seconds"),
    ],
)
def test_unusable_frames_are_refused_and_leave_the_tracker_as_it_was(
    depth: Any, colour: Any, timestamp: float, expected: str
) -> None:
    with blind() as tracker:
        tracker.update(DEPTH, timestamp=1)
        with pytest.raises(dt.InputError, match=expected):
            tracker.update(depth, colour, timestamp=timestamp)
        tracker.update(DEPTH, timestamp=1.5)


def test_a_closed_tracker_and_unknown_choices_are_refused(tmp_path: Path) -> None:
    tracker = blind()
    tracker.close()
    tracker.close()
    with pytest.raises(dt.InputError, match="closed"):
        tracker.update(DEPTH, timestamp=0)
    with pytest.raises(dt.InputError, match="no tracker 'magic'"):
        dt.HandTracker(CAMERA, tracker="magic")
    with pytest.raises(dt.InputError, match=r"hand\.json"):
        dt.HandTracker(CAMERA, tmp_path / "hand.json")
    with pytest.raises(dt.InputError, match="start pose"):
        blind(start_pose=np.zeros(3))


def test_metres_in_single_precision_are_not_copied() -> None:
    with blind() as tracker:
        tracker.update(depth := np.zeros_like(DEPTH), timestamp=0)
        assert tracker.last is not None
        assert tracker.last.frame.depth is depth


@pytest.mark.parametrize(("deadline", "expected"), [(33.0, 33.0), (None, None)])
def test_a_tracker_given_by_name_gets_the_deadline(
    monkeypatch: pytest.MonkeyPatch, deadline: float | None, expected: float | None
) -> None:
    configs = list[Any]()
    monkeypatch.setattr("depthtrack.api.live.create_tracker", lambda config, *_, **__: configs.append(config))
    dt.HandTracker(CAMERA, "average", "ik", deadline=deadline)
    dt.HandTracker(CAMERA, "average", dt.tracker_config("ik", deadline=20.0), deadline=deadline)
    dt.HandTracker(CAMERA, "average", "pso", deadline=deadline)
    assert [getattr(config, "deadline", "none stated") for config in configs] == [expected, 20.0, "none stated"]
