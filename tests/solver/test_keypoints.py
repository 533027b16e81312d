"""Alignment, inverse kinematics on keypoints, and sizes recovered from keypoints."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from depthtrack.calibration.keypoint_calibration import shape_from_keypoints, side_of
from depthtrack.errors import InputError
from depthtrack.geometry.alignment import rigid_alignment
from depthtrack.hand.kinematics import KEYPOINT_BODIES, KEYPOINT_NAMES, HandModel
from depthtrack.hand.limits import LOWER, UPPER
from depthtrack.hand.pose import ANGLE_NAMES, ANGLES, make_pose, retract, tangent_between
from depthtrack.hand.postures import POSTURES
from depthtrack.hand.shape import HandShape, Side
from depthtrack.solver.keypoints import fit_poses

SIDES: tuple[Side, Side] = ("right", "left")
MIDDLE_ABDUCTION = ANGLE_NAMES.index("middle_mcp_abduction")


def random_poses(seed: int, count: int) -> np.ndarray:
    """Return random poses with angles within the limits."""
    rng = np.random.default_rng(seed)
    return make_pose(
        rng.uniform([-0.3, -0.3, 0.3], [0.3, 0.3, 0.9], (count, 3)),
        rng.normal(size=(count, 4)),
        rng.uniform(LOWER, UPPER, (count, 20)),
    )


def distances(model: HandModel, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.asarray(np.linalg.norm(model.keypoints(a) - model.keypoints(b), axis=-1))


@given(seed=st.integers(0, 2**32 - 1))
def test_alignment_recovers_a_rigid_motion_and_agrees_with_scipy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points, R = rng.normal(size=(6, 3)), Rotation.random(rng=rng)
    translation = rng.normal(size=3)
    found_R, found_t = rigid_alignment(points, R.apply(points) + translation)
    np.testing.assert_allclose(found_R, R.as_matrix(), atol=1e-9)
    np.testing.assert_allclose(found_t, translation, atol=1e-9)

    noisy, weights = rng.normal(size=(6, 3)), rng.uniform(0.1, 1, 6)
    found_R, found_t = rigid_alignment(points, noisy, weights)
    p, q = (x - np.average(x, axis=0, weights=weights) for x in (points, noisy))
    best = Rotation.align_vectors(q, p, weights)[0].as_matrix()
    np.testing.assert_allclose(found_R, best, atol=1e-6)
    assert np.linalg.det(found_R) == pytest.approx(1)


def test_points_without_weight_are_ignored() -> None:
    points = np.random.default_rng(0).normal(size=(2, 5, 3))
    target = points + np.array([1.0, 2.0, 3.0])
    target[:, 4] = 1e6
    R, t = rigid_alignment(points, target, [1, 1, 1, 1, 0])
    np.testing.assert_allclose(R, np.tile(np.eye(3), (2, 1, 1)), atol=1e-9)
    np.testing.assert_allclose(t, np.tile([1.0, 2.0, 3.0], (2, 1)), atol=1e-9)


def test_every_keypoint_moves_with_its_body() -> None:
    """The derivative that the fit uses, against finite differences of the keypoints themselves."""
    model, pose, step = HandModel(HandShape()), random_poses(1, 1)[0], 1e-6
    J = model.point_jacobian(pose, KEYPOINT_BODIES, model.keypoints(pose))
    for column in range(26):
        tangent = np.zeros(26)
        tangent[column] = step
        ahead, behind = model.keypoints(retract(pose, tangent)), model.keypoints(retract(pose, -tangent))
        np.testing.assert_allclose(J[..., column], (ahead - behind) / (2 * step), atol=2e-8)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("wrist", [True, False])
def test_any_pose_is_recovered_from_its_keypoints(side: Side, wrist: bool) -> None:
    model, poses = HandModel(HandShape(side=side, scale=1.1)), random_poses(2, 300)
    keypoints = model.keypoints(poses)
    if not wrist:
        keypoints[:, 0] = np.nan
    fitted = fit_poses(model, keypoints)
    assert distances(model, fitted.poses, poses).max() < 1e-7
    assert np.degrees(np.abs(tangent_between(fitted.poses, poses)[:, 3:])).max() < 1e-3
    assert fitted.residuals.max() < 1e-7


@pytest.mark.parametrize(("joint", "least"), [(0, 1.0), (1, 0.95), (2, 0.98)])
def test_known_joints_are_reached_despite_missing_ones(joint: int, least: float) -> None:
    """One joint is missing in every finger; rare local minima remain except for base joints."""
    model, poses = HandModel(HandShape()), random_poses(3, 200)
    keypoints = model.keypoints(poses)
    keypoints[:, 1 + joint :: 4] = np.nan
    fitted = fit_poses(model, keypoints)
    assert np.mean(fitted.residuals < 1e-4) >= least
    if joint == 0:
        assert distances(model, fitted.poses, poses).max() < 1e-6


def test_a_missing_finger_keeps_its_start() -> None:
    model, poses = HandModel(HandShape()), random_poses(4, 50)
    keypoints = model.keypoints(poses)
    keypoints[:, 5:9] = np.nan
    fitted = fit_poses(model, keypoints).poses
    index = fitted[:, ANGLES][:, 4:8]
    starts = [np.abs(index - POSTURES[name][4:8]).max(axis=1) for name in ("relaxed", "fist")]
    assert np.min(starts, axis=0).max() < 1e-9
    others = [k for k in range(21) if not 5 <= k < 9]
    assert distances(model, fitted, poses)[:, others].max() < 1e-6


def test_the_fit_reduces_noise() -> None:
    """63 coordinates determine 26 parameters, so the fit removes part of the noise."""
    rng, noise = np.random.default_rng(5), 0.002
    model, poses = HandModel(HandShape()), random_poses(5, 300)
    noisy = model.keypoints(poses) + rng.normal(scale=noise, size=(300, 21, 3))
    fitted = fit_poses(model, noisy)
    added = np.sqrt(np.mean(np.sum((noisy - model.keypoints(poses)) ** 2, axis=-1)))
    left = np.sqrt(np.mean(distances(model, fitted.poses, poses) ** 2))
    assert left < 0.7 * added
    assert np.median(np.degrees(np.abs(fitted.poses - poses)[:, ANGLES])) < 4
    expected = noise * np.sqrt((63 - 26) / 21)
    assert fitted.residuals.mean() == pytest.approx(expected, rel=0.1)


def test_the_best_pose_within_the_limits_is_returned() -> None:
    """The joint of a finger bent backwards stays at its limit, and no near pose fits better."""
    model = HandModel(HandShape())
    angles = POSTURES["relaxed"].copy()
    angles[ANGLE_NAMES.index("index_pip_flexion")] = np.radians(-25)
    target = model.keypoints(make_pose([0, 0, 0.5], (1, 0, 0, 0), angles))[None]
    fitted = fit_poses(model, target)
    found = fitted.poses[0, ANGLES]
    assert found[ANGLE_NAMES.index("index_pip_flexion")] == 0
    assert np.all((found >= LOWER) & (found <= UPPER))
    rng = np.random.default_rng(6)
    for size in (1e-3, 1e-2):
        near = retract(fitted.poses[0], rng.normal(scale=size, size=(500, 26)) * ([0.1] * 3 + [1] * 23))
        near[:, ANGLES] = np.clip(near[:, ANGLES], LOWER, UPPER)
        others = np.sqrt(np.mean(np.sum((model.keypoints(near) - target) ** 2, axis=-1), axis=-1))
        assert others.min() >= fitted.residuals[0]


def test_a_fit_does_not_depend_on_other_hands() -> None:
    model, poses = HandModel(HandShape()), random_poses(7, 5)
    keypoints = model.keypoints(poses) + np.random.default_rng(7).normal(scale=1e-3, size=(5, 21, 3))
    together = fit_poses(model, keypoints)
    for i in range(5):
        alone = fit_poses(model, keypoints[i])
        np.testing.assert_allclose(alone.poses[0], together.poses[i], atol=1e-9)
    empty = fit_poses(model, np.empty((0, 21, 3)))
    assert empty.poses.shape == (0, 27)


def test_too_few_joints_give_no_pose() -> None:
    keypoints = np.full((2, 21, 3), np.nan)
    keypoints[0] = HandModel(HandShape()).keypoints(random_poses(8, 1))[0]
    keypoints[1, :2] = 0.1
    fitted = fit_poses(HandModel(HandShape()), keypoints)
    assert np.isfinite(fitted.poses[0]).all()
    assert np.isnan(fitted.poses[1]).all()
    assert np.isnan(fitted.residuals[1])


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("wrist", [True, False])
def test_sizes_and_side_are_measured_on_keypoints(side: Side, wrist: bool) -> None:
    """Sizes are exact for average proportions, and fit the keypoints for others."""
    poses = random_poses(9, 60)
    poses[:, ANGLES][:, MIDDLE_ABDUCTION] = np.tile([-0.05, 0, 0.05], 20)  # forward on the average
    default = HandShape()
    uneven = np.linspace(0.9, 1.1, 15).reshape(5, 3)
    for shape, origin in (
        (HandShape(side=side, scale=0.8), 2e-6),
        (HandShape(side=side, scale=1.2, lengths=default.lengths * uneven), 1e-3),
    ):
        keypoints = HandModel(shape).keypoints(poses)
        if not wrist:
            keypoints[:, 0] = np.nan
        assert side_of(keypoints) == side
        measured = shape_from_keypoints(keypoints, side)
        np.testing.assert_allclose(measured.lengths * measured.scale, shape.lengths * shape.scale, rtol=1e-6)
        np.testing.assert_allclose(measured.bases * measured.scale, shape.bases * shape.scale, atol=origin)
        assert fit_poses(HandModel(measured), keypoints).residuals.max() < 1e-5


def test_the_middle_finger_defines_forward_if_the_wrist_is_missing() -> None:
    model, poses = HandModel(HandShape()), random_poses(10, 60)
    poses[:, ANGLES][:, MIDDLE_ABDUCTION] = np.radians(10)
    keypoints = model.keypoints(poses)
    keypoints[:, 0] = np.nan
    fitted = fit_poses(HandModel(shape_from_keypoints(keypoints, "right")), keypoints)
    assert np.degrees(np.median(fitted.poses[:, ANGLES][:, MIDDLE_ABDUCTION])) == pytest.approx(0, abs=0.5)


def test_insufficient_keypoints_are_rejected() -> None:
    keypoints = HandModel(HandShape()).keypoints(random_poses(11, 4))
    no_palm = keypoints.copy()
    no_palm[:, [0, 1, 5, 9, 13]] = np.nan
    with pytest.raises(InputError, match="three of wrist and base joints"):
        shape_from_keypoints(no_palm, "right")
    no_fingers = np.full_like(keypoints, np.nan)
    palm = [KEYPOINT_NAMES.index(name) for name in ("wrist", "thumb_cmc", "index_mcp", "middle_mcp")]
    no_fingers[:, palm] = keypoints[:, palm]
    with pytest.raises(InputError, match="no two neighbouring joints"):
        side_of(no_fingers)
