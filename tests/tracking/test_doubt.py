"""Tracks of low confidence, and the starts that compete with them."""

import math
from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest

from depthtrack.evaluation.metrics import endpoint_error
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape
from depthtrack.recording.sequence import Frame
from depthtrack.recording.status import Status
from depthtrack.segmentation.observation import Observation
from depthtrack.segmentation.roi_tracking import RoiPrior
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.synthesis.generate import Synthesiser
from depthtrack.tracking.configuration import HybridConfig
from depthtrack.tracking.guided_segmentation import segment
from depthtrack.tracking.keypoint_guide import KeypointGuide
from depthtrack.tracking.options import TrackingThresholds
from depthtrack.tracking.pipeline import Pipeline
from depthtrack.tracking.registry import create_tracker, tracker_config
from depthtrack.tracking.stages.branches import turned
from depthtrack.tracking.state import TrackState
from depthtrack.tracking.tracker import Estimate

MODEL = HandModel(HandShape())


@pytest.fixture(scope="module")
def made(everyday_skin: Synthesiser) -> Synthesiser:
    return everyday_skin


def frame_of(made: Synthesiser, index: int) -> Frame:
    """Return a frame without colour."""
    frame = made[index]
    return Frame(index, index / 30, frame.depth.astype(np.float32), None, made.sensor.camera)


def doubtful(pose: np.ndarray, seconds: float, confidence: float = 0.1) -> Estimate:
    """Return the estimate of a track of low confidence."""
    return Estimate(pose, 5.0, 0.9, Status.TRACKED, {}, seconds, confidence)


def test_starts_compete_with_a_track_in_doubt_at_growing_intervals(made: Synthesiser) -> None:
    limits = TrackingThresholds(doubt_confidence=0.25, doubt_after=0.3, longest_doubt=2.0)
    state, due = TrackState(limits, 40.0), []
    state.restore([doubtful(made.poses[0], 0.0, 0.9)])
    for index in range(1, 200):
        seconds = index / 30
        if state.is_in_doubt(seconds):
            due.append(round(seconds - 1 / 30, 2))
            assert state.predicted_pose(seconds) is None
        elif not state.is_stale(seconds):
            assert state.predicted_pose(seconds) is not None
        state.restore([doubtful(made.poses[0], seconds)])
    assert due == [0.3, 0.6, 1.2, 2.0, 2.4, 4.0, 4.8, 6.0]
    # The last pose that was not in doubt was trusted.
    assert state.last_trusted is not None
    assert np.array_equal(state.last_trusted, made.poses[0])
    for confidence, in_doubt in ((0.1, True), (0.3, False), (np.nan, False)):
        state = TrackState(limits, 40.0)
        state.restore([doubtful(made.poses[0], index / 30, confidence) for index in range(9)])
        assert state.is_in_doubt(0.3) == in_doubt
        assert not state.is_in_doubt(1.0)


def test_after_a_doubtful_track_the_hand_is_not_searched_for_near_it(made: Synthesiser) -> None:
    state = TrackState(TrackingThresholds(memory=0.5), 40.0)
    state.restore([doubtful(made.poses[0], 0.0, 0.9), *(doubtful(made.poses[5], i / 30) for i in range(1, 16))])
    before = state.last_trusted
    assert before is not None
    assert np.array_equal(before, made.poses[0])
    assert not state.begins(16 / 30)
    state.commit(made.poses[5], 99.0, 0.1, Status.TRACKED, {}, 16 / 30, 0.01)
    assert state.last_trusted is None
    assert state.begins(17 / 30)


@pytest.mark.parametrize(("confidence", "corrected"), [(0.25, True), (0.0, False)])
def test_a_start_replaces_a_wrong_track_in_doubt(made: Synthesiser, confidence: float, corrected: bool) -> None:
    """Nothing else searches: neither branches, nor recovery, nor single fingers."""
    config = tracker_config("hybrid")
    assert isinstance(config, HybridConfig)
    recovery = replace(config.recovery, good_energy=10.0)
    thresholds = replace(config.thresholds, doubt_confidence=confidence, confidence=0.0, energy=math.inf)
    branches = replace(config.branches, interval=0)
    config = replace(config, recovery=recovery, thresholds=thresholds, branches=branches)
    wrong = turned(made.poses[20], np.zeros((0, 20)))[0]
    with closing(create_tracker(config, made.options.hand)) as tracker:
        pipeline = Pipeline(tracker, Segmenter(None), made.options.hand)
        pipeline.restore([doubtful(wrong, 20 / 30 - 0.3 + index / 30) for index in range(9)])
        found = pipeline.step(frame_of(made, 20)).estimate
    assert found.pose is not None
    error = endpoint_error(MODEL, found.pose[None], MODEL, made.poses[20][None]).values.mean()
    assert (error < 8) == corrected
    assert (found.status is Status.STARTED) == corrected


def test_a_start_that_replaces_a_track_may_be_anywhere(made: Synthesiser) -> None:
    state, far = TrackState(TrackingThresholds(), 40.0), made.poses[0].copy()
    far[0] += 0.5
    for may_jump, status in ((False, Status.LOST), (True, Status.STARTED)):
        state.restore([doubtful(made.poses[0], 0.0)])
        found = state.commit(far, 5.0, 0.9, Status.STARTED, {}, 1 / 30, 0.9, may_jump=may_jump)
        assert found.status is status


class NothingDetected(Segmenter):
    """Finds no hand without a prior."""

    def segment(self, frame: Frame, prior: RoiPrior | None = None) -> Observation | None:
        return None if prior is None else super().segment(frame, prior)


def test_a_track_in_doubt_is_followed_where_no_hand_is_detected(made: Synthesiser) -> None:
    history = [doubtful(made.poses[20], 20 / 30 - 0.3 + index / 30) for index in range(9)]
    for reconsiders in (True, False):
        state = TrackState(TrackingThresholds(), 40.0, reconsiders)
        state.restore(history)
        assert (state.predicted_pose(20 / 30) is None) == reconsiders
        segmenter, keypoints = NothingDetected(None), KeypointGuide(MODEL)
        found, _, failure = segment(frame_of(made, 20), segmenter, MODEL, state, keypoints, lambda: 0.0)
        assert failure is None
        assert found is not None
        assert found.resegmentation is None
