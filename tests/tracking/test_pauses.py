"""After a pause, a start competes with the last pose."""

from contextlib import closing
from dataclasses import replace

import cv2
import numpy as np
import pytest

from depthtrack.hand.pose import ANGLES
from depthtrack.recording.sequence import Frame
from depthtrack.recording.status import Status
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.synthesis.generate import Synthesis, Synthesiser
from depthtrack.tracking.candidate import Candidate
from depthtrack.tracking.configuration import HybridConfig
from depthtrack.tracking.frame import FrameContext, Toolkit
from depthtrack.tracking.options import TrackingThresholds
from depthtrack.tracking.pipeline import Pipeline, TrackedFrame
from depthtrack.tracking.registry import create_tracker, tracker_config
from depthtrack.tracking.stage_tracker import Stages, StageTracker
from depthtrack.tracking.state import TrackState
from depthtrack.types import Array


@pytest.fixture(scope="module")
def made() -> Synthesiser:
    return Synthesiser(Synthesis(motion="everyday", model="skin", frames=20))


def turned(frame: Frame, degrees: float) -> Frame:
    """Return the frame with its image turned about its centre."""
    height, width = frame.depth.shape
    turn = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), degrees, 1)
    depth = cv2.warpAffine(frame.depth, turn, (width, height), flags=cv2.INTER_NEAREST)
    return replace(frame, depth=depth.astype(np.float32))


def track(made: Synthesiser, name: str, frames: list[Frame]) -> list[TrackedFrame]:
    hand = made.options.hand
    with closing(create_tracker(tracker_config(name), hand)) as tracker:
        pipeline = Pipeline(tracker, Segmenter(None), hand)
        return [pipeline.step(frame) for frame in frames]


@pytest.mark.parametrize("name", ["ik", "hybrid", pytest.param("pso", marks=pytest.mark.slow)])
def test_a_hand_that_turned_during_a_pause_is_found(made: Synthesiser, name: str) -> None:
    shown = Frame(0, 0.0, made[0].depth.astype(np.float32), None, made.sensor.camera)
    later = replace(turned(shown, 90), index=1, timestamp=5.0)
    both = track(made, name, [shown, later])
    alone = track(made, name, [later])
    assert all(each.estimate.status.is_trusted for each in both)
    assert both[1].estimate.energy < 1.5 * alone[0].estimate.energy


def test_a_hand_that_stayed_during_a_pause_is_followed(made: Synthesiser) -> None:
    depth = made[0].depth.astype(np.float32)
    frames = [Frame(index, 2.0 * index, depth, None, made.sensor.camera) for index in range(3)]
    energies = [each.estimate.energy for each in track(made, "ik", frames)]
    assert max(energies) < 1.1 * energies[0]


class BySeed:
    """Stage that finds the hand with another seed than 0."""

    name = "search"

    def __init__(self, wrong: Array, right: Array) -> None:
        self._poses = wrong, right

    def __call__(self, frame: FrameContext, candidates: list[Candidate]) -> list[Candidate]:
        return frame.evaluate(self._poses[frame.seed != 0][None])


@pytest.mark.parametrize(("deadline", "repeated"), [(None, True), (33.0, False)])
def test_a_doubtful_start_after_a_pause_is_repeated(made: Synthesiser, deadline: float | None, repeated: bool) -> None:
    right = made[0].pose
    wrong = right.copy()
    wrong[ANGLES.start + 5] += 0.7  # index finger
    config, search = HybridConfig(), BySeed(wrong, right)
    tools, thresholds = Toolkit(made.options.hand, config.scoring), replace(config.thresholds, start_confidence=0.9)
    tracker = StageTracker("hybrid", Stages([search], [search], [search]), tools, thresholds, 0, deadline)
    with closing(tracker):
        energies = []
        for time in (0.0, 0.1, 5.0):
            frame = Frame(0, time, made[0].depth.astype(np.float32), None, made.sensor.camera)
            observation = Segmenter(None).segment(frame)
            assert observation is not None
            energies.append(tracker.track(observation).energy)
    assert energies[0] == energies[1]
    assert (energies[2] < energies[1]) == repeated


@pytest.mark.parametrize(
    ("step", "elapsed", "jump"), [(0.2, 1 / 30, False), (0.25, 1 / 30, True), (0.25, 0.1, False), (1.0, 0.25, False)]
)
def test_a_pose_that_no_hand_reaches_in_time_is_a_jump(step: float, elapsed: float, jump: bool) -> None:
    state, pose = TrackState(TrackingThresholds(), 1.0), np.eye(27)[3] + 0.5 * np.eye(27)[2]
    assert not state.is_jump(pose, 0.0)
    assert state.commit(pose, 0.1, 0.9, Status.STARTED, {}, 1.0, 0.9).status is Status.STARTED
    moved = pose + step * np.eye(27)[0]
    assert state.is_jump(moved, 1.0 + elapsed) is jump
    status = state.commit(moved, 0.1, 0.9, Status.STARTED, {}, 1.0 + elapsed, 0.9).status
    assert status is (Status.LOST if jump else Status.STARTED)
    if jump:
        assert state.commit(moved, 0.1, 0.9, Status.STARTED, {}, 1.1 + elapsed, 0.9).status is Status.STARTED
