"""Spread of the keypoints: visible ones are measured, hidden ones follow the prior."""

from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest

from depthtrack.hand.compiled_kinematics import BodyPoses
from depthtrack.hand.kinematics import KEYPOINT_BODIES, HandModel, body_of
from depthtrack.hand.pose import make_pose, retract
from depthtrack.hand.postures import POSTURES
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.target import Target
from depthtrack.rendering.visibility import FLESH, points_in_view
from depthtrack.synthesis.generate import Synthesiser
from depthtrack.tracking.posture_prior import posture_prior
from depthtrack.tracking.registry import create_tracker, tracker_config
from depthtrack.tracking.spread import (
    CLIPPED,
    BonesInView,
    bone_radii,
    bones_in_view,
    compare_points,
    keypoint_spreads,
)
from depthtrack.types import Array, Depth, Mask
from tests.support.observations import observe

HAND = HandShape()
MODEL = HandModel(HAND)
BACK = np.array([0.0, 1.0, 0.0, 0.0])
"""Orientation of a hand whose back the camera sees."""


def posed(posture: str) -> Array:
    return make_pose(np.array([0, 0, 0.5]), BACK, POSTURES[posture])


def points_of(pose: Array) -> Array:
    ends = MODEL.endpoints(pose).reshape(5, 4, 3)
    return np.stack([ends[:, 1:], (ends[:, 1:] + ends[:, :-1]) / 2], axis=2)


def spread_of(pose: Array, measured: Mask) -> Array:
    ends = MODEL.endpoints(pose).reshape(5, 4, 3)
    bodies = BodyPoses.at(MODEL.chain, pose)
    return keypoint_spreads(MODEL, bodies, ends, points_of(pose), measured, (HAND.uncertainty,))[0]


def compared_with(points: Array, rendered: Depth, target: Target) -> tuple[Mask, Mask, Array]:
    """Return what `compare_points` writes for points (5, 3, 2, 3): visible, own, differences."""
    camera, found = target.camera, (np.empty(30, np.bool_), np.empty(30, np.bool_), np.empty(30))
    images = rendered, target.depth, target.silhouette
    flesh = bone_radii(HAND).reshape(-1)
    compare_points(points.reshape(-1, 3), flesh, (camera.fx, camera.fy, camera.cx, camera.cy), images, *found)
    return found[0].reshape(5, 3, 2), found[1].reshape(5, 3, 2), found[2].reshape(5, 3, 2)


def view_of(posture: str, skin: Synthesiser) -> BonesInView:
    """Return the bones of a hand seen from its back, which the camera observes exactly."""
    observation, pose = observe(skin, 20), posed(posture)
    with closing(create_tracker(tracker_config("ik"), HAND)) as tracker:
        tracker._tools.set_target(observation)
        rendered = tracker._tools.scorer.render(pose)
    return bones_in_view(MODEL, pose, rendered, Target(observation.camera, rendered > 0, rendered))


def test_folded_fingers_are_hidden_behind_the_back_of_the_hand(everyday_skin: Synthesiser) -> None:
    shown, hidden = (view_of(posture, everyday_skin) for posture in ("open", "fist"))
    assert shown.finger_visibility[1:].mean() > hidden.finger_visibility[1:].mean()
    assert shown.spread.max() < 2 * HAND.uncertainty
    assert hidden.spread.max() > 2 * HAND.uncertainty
    palm = [0, 5, 9, 13, 17]
    np.testing.assert_allclose(shown.spread[palm], hidden.spread[palm], rtol=0.5)
    assert np.all(shown.differences[shown.visible] == 0)


def test_fingers_behind_an_object_are_hidden(everyday_skin: Synthesiser) -> None:
    observation, model = observe(everyday_skin, 20), HandModel(everyday_skin.options.hand)
    pose, nothing = everyday_skin.poses[20], np.zeros(observation.camera.shape, np.float32)
    tips = observation.camera.project(model.endpoints(pose).reshape(5, 4, 3)[:, -1])
    u, v = np.meshgrid(*map(np.arange, nothing.shape[::-1]))
    ball = np.hypot(u - tips[1, 0], v - tips[1, 1]) < 25
    for distance, hides in ((0.3, True), (0.7, False)):
        occluder = np.where(ball, distance, 0).astype(np.float32)
        bones = bones_in_view(model, pose, nothing, replace(observation, occluder=occluder))
        assert (bones.finger_visibility[1] < 0.8) == hides
    assert bones_in_view(model, pose, nothing, observation).finger_visibility.min() == 1


@pytest.mark.parametrize("finger", range(5))
def test_a_finger_that_is_not_measured_spreads_alone(finger: int) -> None:
    pose, all_measured = posed("open"), np.ones((5, 3, 2), dtype=np.bool_)
    part = all_measured.copy()
    part[finger] = False
    whole, less = (spread_of(pose, measured) for measured in (all_measured, part))
    hidden = 1 + 4 * finger + np.arange(1, 4)
    assert np.all(less >= whole - 1e-12)
    assert np.all(less[hidden] > 2 * whole[hidden])
    assert np.all(np.diff(less[hidden]) > 0)
    others = np.setdiff1d(np.arange(21), hidden)
    np.testing.assert_allclose(less[others], whole[others], atol=HAND.uncertainty / 2)


def test_the_spread_is_that_of_sampled_poses() -> None:
    """Poses drawn from the prior and the measurements, with their likelihood as weight."""
    pose, measured = posed("open"), np.ones((5, 3, 2), dtype=np.bool_)
    measured[2] = False
    spread = spread_of(pose, measured)
    prior, draw = posture_prior(), np.random.default_rng(5)
    covariance = np.linalg.inv(prior.precision)
    steps = np.zeros((4000, 26))
    # Of a finger that nothing measures, the prior given the other angles remains.
    other = np.setdiff1d(np.arange(20), np.arange(8, 12))
    own = np.linalg.inv(prior.precision[8:12, 8:12])
    assert np.all(np.diag(own) < np.diag(covariance)[8:12])
    steps[:, 6 + 8 : 6 + 12] = draw.multivariate_normal(np.zeros(4), own, len(steps))
    assert np.all(steps[:, 6 + other] == 0)
    J_points = np.array([MODEL.keypoints(retract(pose, 1e-3 * step)) for step in steps])
    sampled = 1e3 * np.sqrt(((J_points - MODEL.keypoints(pose)) ** 2).sum(axis=2).mean(axis=0))
    np.testing.assert_allclose(spread[[10, 11, 12]], sampled[[10, 11, 12]], rtol=0.15)


def test_differences_are_clipped_and_missing_readings_do_not_count(everyday_skin: Synthesiser) -> None:
    observation = observe(everyday_skin, 20)
    pose = everyday_skin.poses[20]
    points, depth = points_of(pose), observation.depth
    with closing(create_tracker(tracker_config("ik"), everyday_skin.options.hand)) as tracker:
        tracker._tools.set_target(observation)
        rendered = tracker._tools.scorer.render(pose)

    def compared(observed: Depth, silhouette: Mask) -> Array:
        return compared_with(points, rendered, Target(observation.camera, silhouette, observed))[2]

    covered = rendered > 0
    assert np.allclose(compared(rendered, covered), 0)
    shifted = np.where(covered, rendered + np.float32(0.02), np.float32(0))
    np.testing.assert_allclose(compared(shifted, covered)[compared(rendered, covered) == 0], 0.02, atol=1e-6)
    assert np.allclose(compared(rendered, np.zeros_like(covered)), CLIPPED)
    assert np.allclose(compared(np.zeros_like(depth), np.ones_like(covered)), CLIPPED)


def test_the_spread_is_that_of_the_dense_precision() -> None:
    rng = np.random.default_rng(3)
    pose, measured = posed("fist"), rng.random((5, 3, 2)) < 0.5
    bodies = np.repeat([body_of(finger, bone) for finger in range(5) for bone in range(3)], 2)
    joints = MODEL.point_jacobian(pose, KEYPOINT_BODIES, MODEL.keypoints(pose))
    bones = MODEL.point_jacobian(pose, bodies, points_of(pose).reshape(-1, 3))
    J = np.concatenate([bones[measured.ravel()], joints[[0, 1, 5, 9, 13, 17]]]).reshape(-1, 26)
    precision = J.T @ J / HAND.uncertainty**2
    precision[6:, 6:] += posture_prior().precision
    expected = np.sqrt(np.einsum("nki,ij,nkj->n", joints, np.linalg.inv(precision), joints))
    np.testing.assert_allclose(spread_of(pose, measured), expected, rtol=1e-9)


def test_points_are_compared_as_in_numpy(everyday_skin: Synthesiser) -> None:
    """Points inside, at the border of, and outside the image, and behind the camera."""
    observation, rng = observe(everyday_skin, 20), np.random.default_rng(8)
    camera = observation.camera
    rendered = np.where(rng.random(camera.shape) < 0.7, 0.5 + 0.04 * rng.random(camera.shape), 0).astype(np.float32)
    pixels = rng.uniform([-3, -3], [camera.width + 2, camera.height + 2], (30, 2))
    points = camera.unproject(pixels, rng.uniform(0.48, 0.56, 30))
    points[:2, 2] = -0.5, 0.0
    visible, own, differences = compared_with(points, rendered, observation)
    np.testing.assert_array_equal(visible.ravel(), points_in_view(points, rendered, camera, FLESH))
    np.testing.assert_array_equal(own.ravel(), points_in_view(points, rendered, camera, bone_radii(HAND).ravel()))
    for point, found in zip(points, differences.ravel(), strict=True):
        u, v = np.rint(np.nan_to_num(camera.project(point), nan=-9)).astype(int)
        parts = []
        for j, i in ((v + dv, u + du) for dv in (-1, 0, 1) for du in (-1, 0, 1)):
            if 0 <= j < camera.height and 0 <= i < camera.width and rendered[j, i] > 0:
                there = observation.depth[j, i]
                if not observation.silhouette[j, i]:
                    parts.append(CLIPPED)
                elif there > 0:
                    parts.append(min(abs(float(rendered[j, i]) - float(there)), CLIPPED))
        assert found == pytest.approx(np.mean(parts) if parts else CLIPPED)


def test_the_true_hand_spreads_less_and_is_trusted_alike(everyday_skin: Synthesiser) -> None:
    observation, pose, true = observe(everyday_skin, 20), everyday_skin.poses[20], HAND.with_(uncertainty=0.0)
    with closing(create_tracker(tracker_config("ik"), HAND)) as tracker:
        tracker._tools.set_target(observation)
        rendered = tracker._tools.scorer.render(pose)
    usual, known = (bones_in_view(HandModel(hand), pose, rendered, observation) for hand in (HAND, true))
    assert np.all(known.spread < usual.spread)
    assert known.spread.min() < HAND.uncertainty / 4
    assert known.widest == usual.widest == usual.spread.max()
