"""Fits to points fixed to bodies: dense residuals, and poses from incomplete points."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from depthtrack.hand.compiled_kinematics import BodyPoses, Chain
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.limits import LOWER, UPPER, within_limits
from depthtrack.hand.pose import ANGLES, make_pose, retract, tangent_between
from depthtrack.hand.shape import HandShape
from depthtrack.hand.synergies import load_synergies
from depthtrack.solver.fixed_points import FixedPoints, squared_residuals
from depthtrack.solver.normal_equations import NormalEquations, clear, energy, normal_equations
from depthtrack.solver.point_fit import PointFitOptions, fit_points, fit_points_each
from depthtrack.solver.prior import Prior
from depthtrack.solver.problem import SolverStatus
from depthtrack.solver.subspace import PostureSubspace
from tests.support.hands import random_pose

SEEDS = st.integers(0, 2**32 - 1)
SHAPE = HandShape(scale=1.1)
CHAIN, HAND = Chain.of(SHAPE), HandModel(SHAPE)
MARKERS = np.repeat(np.arange(16), 3)
"""Three markers on each body: enough to determine any pose."""


def markers(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(0, 0.012, (len(MARKERS), 3))


def block(seed: int, directed: bool) -> tuple[FixedPoints, np.ndarray]:
    """Return random points of a random pose near their targets, some missing."""
    rng = np.random.default_rng(seed)
    pose, local = random_pose(rng), markers(seed)
    targets = HAND.transform_points(pose, MARKERS, local) + rng.normal(0, 0.01, local.shape)
    targets[rng.random(len(targets)) < 0.2] = np.nan
    directions = rng.normal(size=local.shape)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    directions[::2] = 0
    return FixedPoints.of(MARKERS, local, targets, rng.uniform(0, 2, 48), directions if directed else None), pose


def dense_residuals(points: FixedPoints, pose: np.ndarray) -> np.ndarray:
    """Return weighted residuals (N, 3): all coordinates, or the one along the direction."""
    gap = HAND.transform_points(pose, points.body, points.local) - points.target
    along = np.sum(gap * points.direction, axis=1, keepdims=True) * points.direction
    whole = ~points.direction.any(axis=1, keepdims=True)
    return np.asarray(np.where(whole, gap, along) * np.sqrt(points.weight)[:, None])


@given(seed=SEEDS, directed=st.booleans())
def test_normal_equations_equal_the_dense_ones(seed: int, directed: bool) -> None:
    points, pose = block(seed, directed)
    equations, bodies = NormalEquations.empty(), BodyPoses.at(CHAIN, pose)
    clear(equations, bodies)
    H, gradient = np.empty((26, 26)), np.empty(26)
    found = normal_equations(equations, points, bodies, H, gradient)
    assert found == pytest.approx(0.5 * np.sum(dense_residuals(points, pose) ** 2), rel=1e-9)
    assert found == pytest.approx(energy(equations, points, bodies), rel=1e-12)
    assert found == pytest.approx(0.5 * squared_residuals(points, bodies), rel=1e-12)
    steps = 1e-6 * np.eye(26)
    J = np.stack(
        [
            (dense_residuals(points, retract(pose, d)) - dense_residuals(points, retract(pose, -d))).ravel() / 2e-6
            for d in steps
        ],
        axis=1,
    )
    np.testing.assert_allclose(gradient, J.T @ dense_residuals(points, pose).ravel(), atol=1e-8)
    np.testing.assert_allclose(H, J.T @ J, atol=1e-7)


@settings(max_examples=20)
@given(seed=SEEDS, turn=st.floats(0, 1.5))
def test_the_energy_is_exact_far_from_the_start(seed: int, turn: float) -> None:
    points, pose = block(seed, False)
    equations = NormalEquations.empty()
    clear(equations, BodyPoses.at(CHAIN, pose))
    moved = retract(pose, np.r_[0.1, 0, 0, turn, 0, 0, np.full(20, 0.3)])
    expected = 0.5 * np.sum(dense_residuals(points, moved) ** 2)
    assert energy(equations, points, BodyPoses.at(CHAIN, moved)) == pytest.approx(expected, rel=1e-9)


@settings(max_examples=25)
@given(seed=SEEDS, missing=st.floats(0, 0.4))
def test_a_pose_is_recovered_from_incomplete_markers(seed: int, missing: float) -> None:
    rng = np.random.default_rng(seed)
    pose, local = random_pose(rng), markers(seed)
    start = within_limits(retract(pose, rng.normal(0, 1, 26) * np.repeat([0.02, 0.2, 0.2], [3, 3, 20])))
    targets = HAND.transform_points(pose, MARKERS, local)
    gone = rng.random(16) < missing
    targets[np.arange(0, 48, 3)[gone]] = np.nan  # one of the three of a body
    solution = fit_points(CHAIN, MARKERS, local, targets, start=start)
    assert solution.converged
    assert np.abs(tangent_between(solution.pose, pose)).max() < 1e-5
    assert solution.trace[-1] <= solution.trace[0]


def test_weights_decide_between_contradicting_points() -> None:
    start = make_pose([0, 0, 0.5], (1, 0, 0, 0), (LOWER + UPPER) / 2)
    bodies, local = [0, 0], np.zeros((2, 3))
    targets = np.array([[0, 0, 0.5], [0.01, 0, 0.5]])
    solution = fit_points(CHAIN, bodies, local, targets, start=start, weights=[1, 3])
    np.testing.assert_allclose(solution.pose[:3], [0.0075, 0, 0.5], atol=1e-8)
    along = fit_points(
        CHAIN, [0], [[0, 0, 0]], [[0.01, 0.02, 0.4]], start=start, directions=[[0, 0, 1]], options=PointFitOptions()
    )
    np.testing.assert_allclose(along.pose[:3], [0, 0, 0.4], atol=1e-8)


def test_a_prior_determines_missing_fingers_and_a_subspace_constrains_all() -> None:
    rng = np.random.default_rng(4)
    pose, local = random_pose(rng), markers(4)
    targets = HAND.transform_points(pose, MARKERS, local)
    targets[(MARKERS >= 4) & (MARKERS <= 6)] = np.nan
    likely = (LOWER + UPPER) / 2
    held = fit_points(
        CHAIN, MARKERS, local, targets, start=within_limits(pose), prior=Prior.towards(likely, 1e-7)
    ).pose[ANGLES]
    np.testing.assert_allclose(held[4:8], likely[4:8], atol=5e-3)
    np.testing.assert_allclose(np.delete(held, np.s_[4:8]), np.delete(pose[ANGLES], np.s_[4:8]), atol=5e-3)
    space = PostureSubspace.of(load_synergies(), 3)
    bound = fit_points(CHAIN, MARKERS, local, targets, start=pose, subspace=space).pose[ANGLES]
    np.testing.assert_allclose(bound, space.angles(space.project(bound)), atol=1e-9)


def test_a_batch_equals_single_fits() -> None:
    rng = np.random.default_rng(5)
    poses, local = np.stack([random_pose(rng) for _ in range(4)]), markers(5)
    targets = np.stack([HAND.transform_points(pose, MARKERS, local) for pose in poses])
    targets += rng.normal(0, 0.003, targets.shape)
    weights = (rng.random((4, 48)) < 0.8).astype(float)
    found, energies = fit_points_each(CHAIN, MARKERS, local, targets, weights, poses)
    for i in range(4):
        alone = fit_points(CHAIN, MARKERS, local, targets[i], start=poses[i], weights=weights[i])
        np.testing.assert_allclose(found[i], alone.pose, atol=1e-9)
        assert energies[i] == pytest.approx(alone.energy)


def test_the_iteration_limit_ends_a_fit_and_malformed_arrays_are_rejected() -> None:
    rng = np.random.default_rng(6)
    pose, local = random_pose(rng), markers(6)
    targets = HAND.transform_points(pose, MARKERS, local) + rng.normal(0, 0.01, local.shape)
    far = retract(pose, np.r_[0.1, 0, 0, 0.5, 0, 0, np.zeros(20)])
    cut = fit_points(CHAIN, MARKERS, local, targets, start=far, options=replace(PointFitOptions(), iterations=1))
    assert cut.status == SolverStatus.ITERATION_LIMIT
    with pytest.raises(ValueError, match="bodies must be 0 to 15"):
        fit_points(CHAIN, [16], [[0, 0, 0]], [[0, 0, 1]], start=pose)
    with pytest.raises(ValueError, match="reshape"):
        fit_points(CHAIN, [1, 2], [[0, 0, 0]], [[0, 0, 1]], start=pose)
