"""Keypoints from elsewhere: what they improve, and that wrong ones do no harm."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from depthtrack.cli import main
from depthtrack.geometry.rotations import quaternion_product
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import ORIENTATION
from depthtrack.hand.shape import HandShape
from depthtrack.recording.run_folder import Run
from depthtrack.recording.sequence import Frame, ImageKeypoints
from depthtrack.solver.options import IcpOptions
from depthtrack.synthesis.generate import Synthesiser
from depthtrack.tracking.configuration import IkConfig
from depthtrack.tracking.frame import FrameContext, Toolkit
from depthtrack.tracking.keypoint_guide import KeypointGuide
from depthtrack.tracking.registry import create_tracker, tracker_config
from depthtrack.tracking.stages.keypoint_proposals import KeypointProposals
from depthtrack.tracking.state import TrackState
from depthtrack.tracking.tracker import Tracker
from depthtrack.types import Array
from tests.support.keypoints import in_region, keypoints_of, mean_error, mirrored
from tests.support.observations import observe
from tests.support.runs import synthesise
from tests.support.synthesis import synthesiser

MODEL = HandModel(HandShape())
FRAMES = 10
Keypoints = list[ImageKeypoints] | None


@pytest.fixture(scope="module")
def grasp() -> Synthesiser:
    """A grasp seen by a Kinect: the back of the hand hides most of the fingers."""
    return synthesiser(motion="grasp", model="skin", sensor="kinect1")


def track(made: Synthesiser, first: int, keypoints: Keypoints, tracker: Tracker) -> Array:
    """Return the poses (FRAMES, 27) of every second frame from `first`, after a search."""
    poses = []
    for number in range(FRAMES):
        observation = observe(made, first + 2 * number)
        if keypoints is not None:
            observation = replace(observation, keypoints=in_region(keypoints[number], observation))
        poses.append(tracker.track(observation).pose)
    assert all(pose is not None for pose in poses)
    return np.array(poses)


def detected(made: Synthesiser, first: int, swapped: int | None = None) -> list[ImageKeypoints]:
    """Return noisy keypoints with gaps; those of two fingers are swapped in frame `swapped`."""
    numbers = range(FRAMES)
    return [keypoints_of(made, first + 2 * n, 3.0, 0.1, (2, 3) if n == swapped else None) for n in numbers]


def error(made: Synthesiser, first: int, keypoints: Keypoints, name: str = "ik") -> float:
    """Return the mean joint error of a track, metres."""
    poses = track(made, first, keypoints, create_tracker(tracker_config(name), HandShape()))
    return mean_error(MODEL.keypoints(poses), made.joints[first : first + 2 * FRAMES : 2])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ik", "hybrid"])
def test_keypoints_place_hidden_fingers_and_wrong_ones_do_no_harm(grasp: Synthesiser, name: str) -> None:
    first = 40
    found = detected(grasp, first, swapped=5)
    without, with_them = error(grasp, first, None, name), error(grasp, first, found, name)
    assert with_them < 0.6 * without
    wrong = error(grasp, first, [mirrored(each) for each in found], name)
    assert wrong < without + 0.002
    missing = ImageKeypoints(np.full((21, 2), np.nan), np.zeros(21))
    assert error(grasp, first, [missing] * FRAMES, name) == without


def test_the_stated_side_changes_nothing(grasp: Synthesiser) -> None:
    found = detected(grasp, 40)
    left = [replace(each, side="left") for each in found]
    assert error(grasp, 40, found) == error(grasp, 40, left)


@pytest.mark.slow
def test_without_weight_and_proposals_keypoints_change_nothing(everyday_skin: Synthesiser) -> None:
    """The published tracker has neither."""
    found = detected(everyday_skin, 20)
    assert error(everyday_skin, 20, found, "schroeder2014") == error(everyday_skin, 20, None, "schroeder2014")
    assert IcpOptions().keypoint_weight > 0


def test_a_restored_tracker_returns_the_same_bits(everyday_skin: Synthesiser) -> None:
    made, config = everyday_skin, IkConfig()
    observations = []
    for number, keypoints in enumerate(detected(made, 20)[:5]):
        observation = observe(made, 20 + 2 * number)
        observations.append(replace(observation, keypoints=in_region(keypoints, observation)))
    whole = create_tracker(config, HandShape())
    estimates = [whole.track(each) for each in observations]
    resumed = create_tracker(config, HandShape())
    resumed.restore(estimates[:3])
    for observation, estimate in zip(observations[3:], estimates[3:], strict=True):
        np.testing.assert_array_equal(resumed.track(observation).pose, estimate.pose)


@pytest.mark.slow
def test_a_run_is_resumed_with_its_own_keypoints_only(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    made = synthesise(tmp_path / "made", 4, "--keypoints")
    file, run = made / "keypoints.csv", tmp_path / "run"
    command = ["track", str(made), "--tracker", "ik", "--resolution", "64", "--hand", "truth", "--threads", "1"]
    assert main([*command, "-o", str(run), "--keypoints", str(file)]) == 0
    whole = Run.load(run).poses
    lines = (run / "poses.csv").read_text().splitlines(keepends=True)
    (run / "poses.csv").write_text("".join(lines[:3]))
    assert main([*command, "-o", str(run), "--resume"]) == 2
    assert "was begun with" in capsys.readouterr().err
    assert main([*command, "-o", str(run), "--keypoints", str(file), "--resume"]) == 0
    np.testing.assert_array_equal(Run.load(run).poses, whole)
    assert main(["track", str(made), "-o", str(tmp_path / "again"), "--config", str(run)]) == 0
    assert (tmp_path / "again" / "poses.csv").read_bytes() == (run / "poses.csv").read_bytes()
    assert main(["evaluate", str(run)]) == 0
    file.write_text(file.read_text().replace("right", "left"))
    assert main([*command, "-o", str(run), "--keypoints", str(file), "--resume"]) == 2
    assert "digests.keypoints" in capsys.readouterr().err
    file.unlink()
    assert main([*command, "-o", str(tmp_path / "other"), "--keypoints", str(file)]) == 2
    assert "is missing" in capsys.readouterr().err


def context(made: Synthesiser, index: int, keypoints: ImageKeypoints | None) -> FrameContext:
    config = IkConfig()
    tools = Toolkit(HandShape(), config.scoring)
    observation = observe(made, index)
    if keypoints is not None:
        observation = replace(observation, keypoints=in_region(keypoints, observation))
    tools.set_target(observation)
    return FrameContext(observation, tools, TrackState(config.thresholds, config.scoring.objective.clamp), 0)


def test_a_flipped_hand_is_turned_back(everyday_skin: Synthesiser) -> None:
    made, index, config = everyday_skin, 60, IkConfig()
    stage = KeypointProposals(config.keypoints, config.fit)
    flipped = made.poses[index].copy()
    flipped[ORIENTATION] = quaternion_product(flipped[ORIENTATION], [0.0, 0.0, 1.0, 0.0])
    errors = {}
    for name, keypoints in (("none", None), ("right", keypoints_of(made, index, 3.0, 0.1))):
        frame = context(made, index, keypoints)
        (found, *_) = stage(frame, frame.evaluate(flipped[None]))
        errors[name] = mean_error(MODEL.keypoints(found.pose), made.joints[index])
    assert errors["none"] > 0.03
    assert errors["right"] < 0.005


def test_poses_that_agree_with_their_keypoints_are_left_alone(everyday_skin: Synthesiser) -> None:
    made, index, config = everyday_skin, 60, IkConfig()
    frame = context(made, index, keypoints_of(made, index, 3.0))
    candidates = frame.evaluate(made.poses[index][None])
    assert KeypointProposals(config.keypoints, config.fit)(frame, candidates) is candidates


def test_keypoints_guide_the_segmentation_only_if_they_fit_the_depth(everyday_skin: Synthesiser) -> None:
    made, index = everyday_skin, 60
    synthetic, guide = made[index], KeypointGuide(MODEL)
    depth = synthetic.depth.astype(np.float32)
    frame = Frame(index, synthetic.timestamp, depth, synthetic.colour, made.sensor.camera)
    assert guide.pose(frame) is None
    keypoints = keypoints_of(made, index, 3.0)
    pose = guide.pose(replace(frame, keypoints=keypoints))
    assert pose is not None
    assert mean_error(MODEL.wrist(pose), made.joints[index][0]) < 0.015
    order = np.random.default_rng(0).permutation(21)
    assert guide.pose(replace(frame, keypoints=replace(keypoints, pixels=keypoints.pixels[order]))) is None
    assert guide.pose(replace(frame, keypoints=keypoints, depth=np.zeros_like(depth))) is None
