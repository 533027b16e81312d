"""Residuals of 2D keypoints: their geometry, Jacobian and robust weights."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.geometry.camera import PRESETS
from depthtrack.hand.compiled_kinematics import BodyPoses
from depthtrack.hand.kinematics import KEYPOINT_BODIES, HandModel
from depthtrack.hand.pose import retract
from depthtrack.hand.shape import HandShape
from depthtrack.recording.sequence import ImageKeypoints
from depthtrack.solver.fixed_points import squared_residuals
from depthtrack.solver.keypoints import local_keypoints
from depthtrack.solver.normal_equations import NormalEquations, clear, normal_equations
from depthtrack.solver.reprojection import LinesOfSight, depth_cost, depth_weight, mean_misfit
from depthtrack.types import Array
from tests.support.hands import random_pose_in_view

CAMERA, MODEL = PRESETS["kinect1"], HandModel(HandShape(side="left"))
LOCAL = local_keypoints(MODEL)
SEEDS = st.integers(0, 2**32 - 1)


def sight(seed: int, noise: float, missing: float = 0.0) -> tuple[LinesOfSight, Array]:
    """Return lines of sight of a random pose, `noise` pixels off, and the pose."""
    rng, pose = np.random.default_rng(seed), random_pose_in_view(seed)
    points = MODEL.keypoints(pose)
    pixels = CAMERA.project(points) + noise * rng.standard_normal((21, 2))
    pixels[rng.random(21) < missing] = np.nan
    reach = np.linalg.norm(points, axis=-1) + 0.02 * rng.standard_normal(21)
    return LinesOfSight.of(ImageKeypoints(pixels, rng.uniform(0.2, 1, 21)), CAMERA, LOCAL, reach), pose


def bodies_at(pose: Array) -> BodyPoses:
    return BodyPoses.at(MODEL.chain, pose)


def dense_residuals(lines: LinesOfSight, pose: Array) -> Array:
    """Return the weighted residuals (21, 4) by the definition: (I - d d^T) x, and d . x - r."""
    x, d = MODEL.keypoints(pose), lines.directions
    along = np.sum(x * d, axis=-1, keepdims=True)
    weights = lines.block.weight.reshape(21, 3)
    across = (x - along * d) * np.sqrt(weights[:, :1])
    return np.concatenate([across, (along - lines.reach[:, None]) * np.sqrt(weights[:, 2:])], axis=1)


@given(seed=SEEDS)
def test_the_residual_in_pixels_is_the_reprojection_error(seed: int) -> None:
    lines, pose = sight(seed, noise=0.5)
    across, _ = lines.distances(bodies_at(pose))
    points = MODEL.keypoints(pose)
    error = np.linalg.norm(CAMERA.project(points) - CAMERA.project(lines.directions), axis=-1)
    # A ray that is inclined by an angle a crosses the plane of the image at cos a.
    cosine = points[:, 2] / np.linalg.norm(points, axis=-1)
    pixels = across / points[:, 2] * CAMERA.fx
    assert np.all(pixels <= error * 1.001 + 1e-6)
    assert np.all(pixels >= error * cosine * 0.999 - 1e-6)


@given(seed=SEEDS)
def test_the_equations_are_those_of_finite_differences(seed: int) -> None:
    lines, pose = sight(seed, noise=4.0, missing=0.2)
    lines.reweigh(bodies_at(pose), weight=1.5, scale=0.02, along_weight=0.7)
    equations, H, gradient = NormalEquations.empty(), np.empty((26, 26)), np.empty(26)
    clear(equations, bodies_at(pose))
    energy = normal_equations(equations, lines.block, bodies_at(pose), H, gradient)
    step, e = 1e-6, dense_residuals(lines, pose)
    J = np.stack(
        [
            dense_residuals(lines, retract(pose, step * one)) - dense_residuals(lines, retract(pose, -step * one))
            for one in np.eye(26)
        ],
        axis=-1,
    ) / (2 * step)
    np.testing.assert_allclose(energy, 0.5 * np.sum(e**2), rtol=1e-9)
    np.testing.assert_allclose(gradient, np.einsum("nk,nkj->j", e, J), atol=1e-7)
    np.testing.assert_allclose(H, np.einsum("nki,nkj->ij", J, J), atol=1e-7)


@given(seed=SEEDS)
def test_unknown_keypoints_have_no_weight(seed: int) -> None:
    lines, pose = sight(seed, noise=4.0, missing=1.0)
    lines.reweigh(bodies_at(pose), 1.0, 0.02, 1.0)
    assert squared_residuals(lines.block, bodies_at(pose)) == 0
    assert mean_misfit(lines.misfits(bodies_at(pose), 0.02)) == 1


def test_misfit_grows_from_zero_to_one() -> None:
    lines, pose = sight(3, noise=0.0)
    away = [retract(pose, np.eye(26)[0] * shift) for shift in (0.0, 0.01, 0.1, 10.0)]
    misfits = [mean_misfit(lines.misfits(bodies_at(each), 0.015)) for each in away]
    assert misfits == sorted(misfits)
    assert misfits[0] < 1e-9
    assert misfits[-1] > 0.99


def test_weights_of_depth_minimise_its_cost() -> None:
    along, step = np.linspace(-0.1, 0.1, 400), 1e-6  # none at the joint of both branches
    slope = (depth_cost(along + step, 0.015) - depth_cost(along - step, 0.015)) / (2 * step)
    np.testing.assert_allclose(slope, 2 * along * depth_weight(along, 0.015), atol=1e-7)
    assert depth_weight(np.array([np.nan]), 0.015)[0] == 0
    # Hidden points cost little; points before the surface cost more the farther they are.
    assert depth_cost(np.array([0.2]), 0.015)[0] < 0.015**2 < depth_cost(np.array([-0.05]), 0.015)[0]


def test_the_block_has_three_rows_of_each_keypoint() -> None:
    lines, _ = sight(0, noise=0.0)
    np.testing.assert_array_equal(lines.block.body, np.repeat(KEYPOINT_BODIES, 3))
    axes = lines.block.direction.reshape(21, 3, 3)
    np.testing.assert_allclose(np.einsum("nij,nkj->nik", axes, axes), np.tile(np.eye(3), (21, 1, 1)), atol=1e-12)
