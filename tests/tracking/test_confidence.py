"""Confidence of an estimate."""

import math
from contextlib import closing

import numpy as np
import pytest

from depthtrack.rendering.target import Target
from depthtrack.synthesis.generate import Synthesiser
from depthtrack.tracking.confidence import (
    ConfidenceModel,
    Evidence,
    compare_images,
    evidence_of,
    fitted_model,
)
from depthtrack.tracking.registry import create_tracker, tracker_config
from depthtrack.tracking.spread import CLIPPED, BonesInView
from tests.support.observations import observe


def test_the_confidence_is_a_logistic_function() -> None:
    weights = tuple(0.1 * k for k in range(len(Evidence._fields)))
    evidence = Evidence(*(1.0,) * len(weights))
    assert ConfidenceModel(weights, 0.0)(evidence) == pytest.approx(1 / (1 + math.exp(-sum(weights))))
    assert ConfidenceModel(weights, -1e9)(evidence) < 1e-12


def test_better_evidence_gives_more_confidence() -> None:
    """All fingers measured, a low energy and thin residual outlines, against the opposite."""
    good = Evidence(-2.0, 1.0, 1.0, 0.05, 0.0, 1.2, 1.0, 3.0, 8.0)
    bad = Evidence(0.0, 2.5, 3.5, 0.4, 0.2, 3.9, 3.0, 9.0, 8.0)
    assert fitted_model()(good) > 0.7
    assert fitted_model()(bad) < 0.3


def test_evidence_counts_both_silhouettes(everyday_skin: Synthesiser) -> None:
    observation = observe(everyday_skin, 20)
    target = Target(observation.camera, observation.silhouette, observation.depth)
    differences, spread = np.full((5, 3, 2), 0.001), np.full(21, 0.002)
    differences[3], spread[[0, 20]] = 0.03, (0.5, 0.05)
    bones = BonesInView(np.ones((5, 3, 2), dtype=np.bool_), differences, spread, 4.0)

    def evidence(rendered: np.ndarray) -> Evidence:
        return evidence_of(everyday_skin.poses[20], rendered, target, bones, 0.2)

    whole = evidence(observation.depth)
    assert (whole.in_vain, whole.thick_unexplained, whole.posture) == (0, 0, 4.0)
    assert whole.energy == pytest.approx(math.log(0.2))
    assert whole.finger_difference == pytest.approx(math.log(30))
    assert (whole.largest_spread, whole.usual_spread) == pytest.approx((math.log(50), math.log(2)))
    half = observation.depth.copy()
    half[: half.shape[0] // 2] = 0
    assert evidence(half).thick_unexplained > 0.2
    shifted = np.roll(observation.depth, 30, axis=1)
    assert evidence(shifted).in_vain > 0.1
    assert evidence(observation.depth + 0.03 * (observation.depth > 0)).depth_difference > math.log(20)


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
