"""Confidence of an estimate."""

import math
from contextlib import closing

import numpy as np
import pytest

from depthtrack.hand.pose import make_pose
from depthtrack.hand.postures import POSTURES
from depthtrack.recording.status import Status
from depthtrack.rendering.target import Target
from depthtrack.synthesis.generate import Synthesiser
from depthtrack.tracking.confidence import (
    ConfidenceModel,
    Evidence,
    evidence_of,
    fitted_model,
)
from depthtrack.tracking.options import TrackingThresholds
from depthtrack.tracking.registry import create_tracker, tracker_config
from depthtrack.tracking.spread import BonesInView
from depthtrack.tracking.state import TrackState
from tests.support.observations import observe


def test_the_confidence_is_a_logistic_function() -> None:
    weights = tuple(0.1 * k for k in range(len(Evidence._fields)))
    evidence = Evidence(*(1.0,) * len(weights))
    assert ConfidenceModel(weights, 0.0)(evidence) == pytest.approx(1 / (1 + math.exp(-sum(weights))))
    assert ConfidenceModel(weights, -1e9)(evidence) < 1e-12


def test_better_evidence_gives_more_confidence() -> None:
    """A low energy, a covered silhouette and measured fingers, against the opposite."""
    assert fitted_model()(Evidence(-2.0, 0.0, 2.0, 3.0)) > 0.7
    assert fitted_model()(Evidence(0.0, 0.2, 3.9, 9.0)) < 0.3


def test_evidence_counts_what_the_hand_leaves_unexplained(everyday_skin: Synthesiser) -> None:
    observation = observe(everyday_skin, 20)
    target = Target(observation.camera, observation.silhouette, observation.depth)
    spread = np.full(21, 0.002)
    spread[7] = 0.05
    bones = BonesInView(np.ones((5, 3, 2), dtype=np.bool_), np.zeros((5, 3, 2)), spread, float(spread.max()), 4.0)

    def evidence(rendered: np.ndarray) -> Evidence:
        return evidence_of(everyday_skin.poses[20], rendered, target, bones, 0.2)

    whole = evidence(observation.depth)
    assert whole == pytest.approx((math.log(0.2), 0.0, math.log(50), 4.0))
    half = observation.depth.copy()
    half[: half.shape[0] // 2] = 0
    assert evidence(half).unexplained > 0.2
    shifted = np.roll(observation.depth, 1, axis=1)
    assert evidence(shifted).unexplained < 0.01


@pytest.mark.parametrize("name", ["ik", "pso", "hybrid"])
def test_estimates_have_a_confidence_that_resumes(everyday_skin: Synthesiser, name: str) -> None:
    frames = [observe(everyday_skin, index) for index in range(20, 24)]
    hand = everyday_skin.options.hand
    with (
        closing(create_tracker(tracker_config(name), hand)) as whole,
        closing(create_tracker(tracker_config(name), hand)) as cut,
    ):
        estimates = [whole.start(frames[0], everyday_skin.poses[20]), *map(whole.track, frames[1:])]
        cut.restore(estimates[:2])
        again = [cut.track(frame) for frame in frames[2:]]
    for one, other in zip(estimates[2:], again, strict=True):
        assert 0 < one.confidence < 1
        assert np.all(np.array(one.spread) > 0)
        assert (one.confidence, one.visibility, one.spread) == (other.confidence, other.visibility, other.spread)


@pytest.mark.parametrize(
    ("first", "second", "status"),
    [
        (0.3, 0.01, Status.TRACKED),
        (0.03, 0.0004, Status.LOST),
        (0.03, 0.025, Status.TRACKED),
        (0.9, 1e-9, Status.LOST),
        (math.nan, 0.0, Status.TRACKED),
    ],
)
def test_a_track_is_lost_by_the_confidence_of_two_frames(first: float, second: float, status: Status) -> None:
    state, pose = TrackState(TrackingThresholds(), 40.0), make_pose([0, 0, 0.5], [0, 1, 0, 0], POSTURES["open"])
    assert state.commit(pose, 4.0, 0.9, Status.STARTED, {}, 0.0, first).status is Status.STARTED
    assert state.commit(pose, 4.0, 0.9, Status.TRACKED, {}, 0.03, second).status is status


@pytest.mark.parametrize(
    ("energy", "confidence", "status", "guides"),
    [
        (7.9, 0.1, Status.TRACKED, True),
        (30.0, 0.1, Status.TRACKED, False),
        (30.0, 0.3, Status.TRACKED, True),
        (41.0, 0.1, Status.LOST, False),
        (41.0, 0.3, Status.TRACKED, True),
        (30.0, math.nan, Status.TRACKED, False),
        (41.0, math.nan, Status.LOST, False),
    ],
)
def test_a_confident_pose_is_trusted_and_guides_whatever_its_energy(
    energy: float, confidence: float, status: Status, guides: bool
) -> None:
    """The energy of a hand that is partly hidden exceeds twice its median in right poses."""
    thresholds = TrackingThresholds(energy=0.4, lost_ratio=2.0, guide_ratio=1.3, sure_confidence=0.3)
    state, pose = TrackState(thresholds, 40.0), make_pose([0, 0, 0.5], [0, 1, 0, 0], POSTURES["open"])
    for frame in range(3):
        state.commit(pose, 20.0, 0.9, Status.TRACKED, {}, frame / 30, confidence)
    assert state.commit(pose, energy, 0.9, Status.TRACKED, {}, 0.1, confidence).status is status
    assert (state.predicted_pose(0.13) is not None) == guides


def test_a_start_of_low_confidence_is_lost() -> None:
    state, pose = TrackState(TrackingThresholds(), 40.0), make_pose([0, 0, 0.5], [0, 1, 0, 0], POSTURES["open"])
    assert state.commit(pose, 4.0, 0.9, Status.STARTED, {}, 0.0, 0.02).status is Status.LOST
