"""Confidence of an estimate, and the visibility of fingers."""

import math
from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest

from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import make_pose
from depthtrack.hand.postures import POSTURES
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.target import Target
from depthtrack.synthesis.generate import Synthesiser
from depthtrack.tracking.confidence import (
    CLIPPED,
    LONGEST_TRACK,
    ConfidenceModel,
    Evidence,
    compare_images,
    evidence_of,
    finger_visibility,
    fitted_model,
)
from depthtrack.tracking.registry import create_tracker, tracker_config
from tests.support.observations import observe

HAND = HandShape()
MODEL = HandModel(HAND)


def test_the_confidence_is_a_logistic_function() -> None:
    weights = tuple(0.1 * k for k in range(len(Evidence._fields)))
    evidence = Evidence(*(1.0,) * len(weights))
    assert ConfidenceModel(weights, 0.0)(evidence) == pytest.approx(1 / (1 + math.exp(-sum(weights))))
    assert ConfidenceModel(weights, -1e9)(evidence) < 1e-12


def test_better_evidence_gives_more_confidence() -> None:
    """All fingers in view, a low energy and thin residual outlines, against the opposite."""
    good = Evidence(-2.0, 0.0, 1.0, 0.05, 0.05, 0.0, 0.0, 1.0, 1.0, 1.6, 8.0, 2.0)
    bad = Evidence(0.0, 1.0, 2.5, 0.4, 0.4, 0.2, 0.2, 0.3, 0.0, 0.8, 8.0, 0.0)
    assert fitted_model()(good) > 0.7
    assert fitted_model()(bad) < 0.3


def test_evidence_counts_both_silhouettes(everyday_skin: Synthesiser) -> None:
    observation = observe(everyday_skin, 20)
    target = Target(observation.camera, observation.silhouette, observation.depth)
    visibility = np.array([1.0, 1.0, 0.5, 1.0, 0.0])

    def evidence(rendered: np.ndarray, age: float) -> Evidence:
        pose = everyday_skin.poses[20]
        return evidence_of(pose, rendered, target, HAND, visibility, 0.2, 0.1, age)

    whole = evidence(observation.depth, 9.0)
    assert whole.unexplained <= np.mean(observation.depth[observation.silhouette] == 0)
    assert (whole.in_vain, whole.thick_unexplained, whole.age) == (0, 0, LONGEST_TRACK)
    assert (whole.visible, whole.least_visible) == (0.7, 0.0)
    assert whole.energy == pytest.approx(math.log(0.2))
    half = observation.depth.copy()
    half[: half.shape[0] // 2] = 0
    assert evidence(half, 0.0).thick_unexplained > 0.2
    shifted = np.roll(observation.depth, 30, axis=1)
    assert evidence(shifted, 0.0).thick_in_vain > 0.1
    assert evidence(observation.depth + 0.03 * (observation.depth > 0), 0.0).depth_difference > math.log(20)


def test_folded_fingers_are_hidden_behind_the_back_of_the_hand(everyday_skin: Synthesiser) -> None:
    observation = observe(everyday_skin, 20)
    shares = []
    for name in ("open", "fist"):
        # The camera sees the back of the hand.
        pose = make_pose(np.array([0, 0, 0.5]), np.array([0.0, 1.0, 0.0, 0.0]), POSTURES[name])
        with closing(create_tracker(tracker_config("ik"), HAND)) as tracker:
            tracker._tools.set_target(observation)
            rendered = tracker._tools.scorer.render(pose)
        shares.append(finger_visibility(MODEL, pose, rendered, observation)[1:].mean())
    assert shares[0] > shares[1]


def test_fingers_behind_an_object_are_hidden(everyday_skin: Synthesiser) -> None:
    observation = observe(everyday_skin, 20)
    pose, nothing = everyday_skin.poses[20], np.zeros(observation.camera.shape, np.float32)
    tips = observation.camera.project(MODEL.endpoints(pose).reshape(5, 4, 3)[:, -1])
    u, v = np.meshgrid(*map(np.arange, nothing.shape[::-1]))
    ball = np.hypot(u - tips[1, 0], v - tips[1, 1]) < 25
    for distance, hides in ((0.3, True), (0.7, False)):
        occluder = np.where(ball, distance, 0).astype(np.float32)
        shares = finger_visibility(MODEL, pose, nothing, replace(observation, occluder=occluder))
        assert (shares[1] < 0.8) == hides
    assert finger_visibility(MODEL, pose, nothing, observation).min() == 1


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
        assert (one.confidence, one.visibility) == (other.confidence, other.visibility)


def test_the_comparison_of_images_equals_its_definition() -> None:
    draw = np.random.default_rng(3)
    rendered, depth = (
        np.where(draw.random((9, 13)) < 0.5, 0, draw.uniform(0.4, 0.6, (9, 13))).astype(np.float32) for _ in range(2)
    )
    silhouette = draw.random((9, 13)) < 0.6
    unexplained, in_vain = np.zeros((9, 13), np.bool_), np.zeros((9, 13), np.bool_)
    *counts, difference = compare_images(rendered, depth, silhouette, unexplained, in_vain)
    covered = rendered > 0
    both = covered & (depth > 0)
    np.testing.assert_array_equal(unexplained, silhouette & ~covered)
    np.testing.assert_array_equal(in_vain, covered & ~silhouette)
    assert counts == [silhouette.sum(), covered.sum(), unexplained.sum(), in_vain.sum(), both.sum()]
    gaps = np.abs(rendered[both].astype(float) - depth[both].astype(float))
    assert difference == pytest.approx(np.minimum(gaps, CLIPPED).sum())
