"""Residuals, normal equations and Gauss-Newton, compared with dense computations."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from depthtrack.hand.compiled_kinematics import BodyPoses, Chain
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.limits import LOWER, UPPER, within_limits
from depthtrack.hand.pose import ANGLES, retract, tangent_between
from depthtrack.hand.shape import HandShape
from depthtrack.hand.synergies import load_synergies
from depthtrack.solver import normal_equations as sums
from depthtrack.solver import problem as problems
from depthtrack.solver.correspondences import Correspondences, PointCloud
from depthtrack.solver.fixed_points import FixedPoints
from depthtrack.solver.gauss_newton import minimise
from depthtrack.solver.normal_equations import NormalEquations
from depthtrack.solver.options import Residual
from depthtrack.solver.prior import Prior, add_prior, reduced_precision
from depthtrack.solver.problem import Solution, SolverOptions, SolverStatus, limit_gradient
from depthtrack.solver.residuals import add_correspondences, weight
from depthtrack.solver.subspace import FULL, PostureSubspace, reduce_to_subspace
from tests.support.hands import random_pose

SEEDS = st.integers(0, 2**32 - 1)
RESIDUALS = st.sampled_from(["point", "plane", "symmetric"])
SOFTNESS = st.sampled_from([0.0, 0.01])
SHAPE = HandShape()
CHAIN, HAND = Chain.of(SHAPE), HandModel(SHAPE)
NO_POINTS = FixedPoints.none()


class Problem:
    """Random correspondences of a random hand; some points have none.

    rows: (M, 3 or 1, 3) directions of the residuals.
    """

    def __init__(self, seed: int, residual: Residual, kernel_scale: float, count: int = 60) -> None:
        rng = np.random.default_rng(seed)
        self.residual, self.kernel_scale = residual, kernel_scale
        self.pose = random_pose(rng)
        body = rng.integers(-1, 16, count)
        self.local = rng.normal(0, 0.02, (count, 3))
        x = HAND.transform_points(self.pose, np.maximum(body, 0), self.local)
        self.correspondences = Correspondences(body, x, _unit(rng.normal(size=(count, 3))))
        self.cloud = PointCloud(x + rng.normal(0, 0.008, (count, 3)), _unit(rng.normal(size=(count, 3))))
        self.bodies, self.equations = BodyPoses.at(CHAIN, self.pose), NormalEquations.empty()
        sums.clear(self.equations, self.bodies)
        add_correspondences(self.equations, self.correspondences, self.cloud, residual, kernel_scale)
        self.kept = body >= 0
        normals = self.correspondences.n + (self.cloud.normals if residual == "symmetric" else 0)
        self.rows = np.tile(np.eye(3), (count, 1, 1)) if residual == "point" else _unit(normals)[:, None]
        gap = np.linalg.norm(x - self.cloud.points, axis=1)
        self.weights = np.ones(count) if kernel_scale == 0 else 1 / (1 + (gap / kernel_scale) ** 2) ** 2

    def residuals(self, pose: np.ndarray) -> np.ndarray:
        """Return the residuals (M, 3 or 1) at a pose, with fixed weights and directions."""
        gap = HAND.transform_points(pose, np.maximum(self.correspondences.body, 0), self.local) - self.cloud.points
        return np.asarray(np.einsum("nri,ni->nr", self.rows, gap))[self.kept]

    def energy(self, pose: np.ndarray) -> float:
        return float(0.5 * np.sum(self.weights[self.kept, None] * self.residuals(pose) ** 2))

    def normal_equations(self) -> tuple[np.ndarray, np.ndarray]:
        """Return J^T W J and J^T W e from the dense Jacobian."""
        J = HAND.point_jacobian(self.pose, np.maximum(self.correspondences.body, 0), self.correspondences.x)
        J = np.einsum("nri,nij->nrj", self.rows, J)[self.kept]
        w = self.weights[self.kept]
        return np.einsum("n,nri,nrj->ij", w, J, J), np.einsum("n,nri,nr->i", w, J, self.residuals(self.pose))


def _unit(vectors: np.ndarray) -> np.ndarray:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def _slope(function: Callable[[np.ndarray], float], size: int, h: float = 1e-6) -> np.ndarray:
    steps = h * np.eye(size)
    return np.array([(function(step) - function(-step)) / (2 * h) for step in steps])


@given(seed=SEEDS, residual=RESIDUALS, kernel_scale=SOFTNESS)
def test_normal_equations_are_those_of_the_dense_jacobian(seed: int, residual: Residual, kernel_scale: float) -> None:
    problem = Problem(seed, residual, kernel_scale)
    H, gradient = np.empty((26, 26)), np.empty(26)
    found = sums.normal_equations(problem.equations, NO_POINTS, problem.bodies, H, gradient)
    expected_H, expected_gradient = problem.normal_equations()
    np.testing.assert_allclose(H, expected_H, atol=1e-9 * np.abs(expected_H).max())
    np.testing.assert_allclose(gradient, expected_gradient, atol=1e-9)
    assert found == pytest.approx(problem.energy(problem.pose), rel=1e-9)
    assert found == pytest.approx(sums.energy(problem.equations, NO_POINTS, problem.bodies), rel=1e-9)


@settings(max_examples=10)
@given(seed=SEEDS, residual=RESIDUALS, kernel_scale=SOFTNESS)
def test_the_gradient_agrees_with_finite_differences(seed: int, residual: Residual, kernel_scale: float) -> None:
    problem = Problem(seed, residual, kernel_scale)
    gradient = np.empty(26)
    sums.normal_equations(problem.equations, NO_POINTS, problem.bodies, np.empty((26, 26)), gradient)
    slope = _slope(lambda step: problem.energy(retract(problem.pose, step)), 26)
    np.testing.assert_allclose(gradient, slope, atol=1e-7)


@settings(max_examples=10)
@given(seed=SEEDS, residual=RESIDUALS)
def test_sums_approximate_energy_and_gradient_after_small_steps(seed: int, residual: Residual) -> None:
    """The sums are exact to first order in the rotation of a body."""
    problem = Problem(seed, residual, 0.01)
    pose = retract(problem.pose, np.random.default_rng(seed).normal(0, 0.004, 26))
    bodies, gradient = BodyPoses.at(CHAIN, pose), np.empty(26)
    found = sums.normal_equations(problem.equations, NO_POINTS, bodies, np.empty((26, 26)), gradient)
    assert found == pytest.approx(problem.energy(pose), rel=1e-2)
    assert found == pytest.approx(sums.energy(problem.equations, NO_POINTS, bodies), rel=1e-9)
    slope = _slope(lambda step: problem.energy(retract(pose, step)), 26)
    assert np.linalg.norm(gradient - slope) < 0.02 * np.linalg.norm(slope)


@given(gap=st.floats(0, 0.1), kernel_scale=st.sampled_from([0.0, 0.003, 0.03]))
def test_weights_equal_the_geman_mcclure_kernel(gap: float, kernel_scale: float) -> None:
    x, y, z = gap * np.array([2, -1, 2]) / 3
    expected = 1.0 if kernel_scale == 0 else (kernel_scale**2 / (kernel_scale**2 + gap**2)) ** 2
    assert weight(x, y, z, kernel_scale) == pytest.approx(expected)
    assert kernel_scale == 0 or weight(kernel_scale, 0.0, 0.0, kernel_scale) == pytest.approx(0.25)


@given(seed=SEEDS, count=st.integers(1, 20))
def test_synergies_reduce_the_system_as_in_equation_8(seed: int, count: int) -> None:
    problem, space = Problem(seed, "plane", 0.0), PostureSubspace.of(load_synergies("leap-grasps"), count)
    H, gradient = problem.normal_equations()
    A, b = np.empty((6 + count, 6 + count)), np.empty(6 + count)
    reduce_to_subspace(H, gradient, space, A, b)
    M = np.zeros((26, 6 + count))
    M[:6, :6], M[6:, 6:] = np.eye(6), space.basis
    np.testing.assert_allclose(A, M.T @ H @ M, atol=1e-9 * np.abs(H).max())
    np.testing.assert_allclose(b, M.T @ gradient, atol=1e-12)


@given(
    low=st.floats(-2, 1),
    width=st.floats(0.05, 3),
    share=st.floats(0.02, 0.98),
)
def test_the_limit_slope_agrees_with_finite_differences(low: float, width: float, share: float) -> None:
    high, x, h = low + width, low + share * width, 1e-6 * width

    def limit_function(x: float) -> float:
        return (high - low) ** 2 / ((high - x) * (x - low))

    slope = (limit_function(x + h) - limit_function(x - h)) / (2 * h)
    assert limit_gradient(x, low, high) == pytest.approx(abs(slope), rel=1e-4, abs=1e-3 / width)
    assert math.isfinite(limit_gradient(low, low, high))


def solved(problem: Problem, space: PostureSubspace, prior: Prior, options: SolverOptions) -> Solution:
    return minimise(problems.Problem(CHAIN, problem.equations, NO_POINTS, prior, space), options, problem.pose)


@given(seed=SEEDS, residual=RESIDUALS, strength=st.sampled_from([1e-4, 1e-2]))
def test_one_step_equals_damped_least_squares(seed: int, residual: Residual, strength: float) -> None:
    """Eq. (4) with a prior. The residuals are small enough for a full, unlimited step."""
    problem = Problem(seed, residual, 0.0)
    problem.pose[ANGLES] = (LOWER + UPPER) / 2
    problem = _nearly_met(problem, 1e-3)
    prior = Prior.towards(problem.pose[ANGLES] + 1e-4, strength)
    solution = solved(problem, FULL, prior, SolverOptions(1, 1e-3))
    H, gradient = problem.normal_equations()
    H[6:, 6:] += strength * np.eye(20)
    gradient[6:] -= strength * 1e-4
    D = np.diag(np.repeat([1e-9, 1e-11, 1e-3], [3, 3, 20]))
    step = np.linalg.solve(H + D, -gradient)
    np.testing.assert_allclose(solution.pose, retract(problem.pose, step), atol=1e-9 + 1e-6 * np.abs(step).max())


def _nearly_met(problem: Problem, share: float) -> Problem:
    """Return the correspondences at the current pose, with distances scaled by `share`."""
    gap = problem.cloud.points - problem.correspondences.x
    problem.bodies = BodyPoses.at(CHAIN, problem.pose)
    problem.correspondences.x[:] = HAND.transform_points(
        problem.pose, np.maximum(problem.correspondences.body, 0), problem.local
    )
    problem.cloud.points[:] = problem.correspondences.x + share * gap
    sums.clear(problem.equations, problem.bodies)
    add_correspondences(problem.equations, problem.correspondences, problem.cloud, problem.residual, 0.0)
    return problem


@given(seed=SEEDS, residual=RESIDUALS, count=st.sampled_from([None, 3, 12]), avoid=st.booleans())
def test_solving_decreases_the_energy_within_the_limits(
    seed: int, residual: Residual, count: int | None, avoid: bool
) -> None:
    problem = Problem(seed, residual, 0.0)
    space = FULL if count is None else PostureSubspace.of(load_synergies(), count)
    problem.pose[ANGLES] = space.angles(space.project(problem.pose[ANGLES]))
    problem = _nearly_met(problem, 0.05)
    after = solved(problem, space, Prior.none(), SolverOptions(8, 1e-6, avoid_limits=avoid))
    assert after.energy < sums.energy(problem.equations, NO_POINTS, problem.bodies)
    # The sums are exact to first order: the exact energy may increase after large rotations.
    if np.abs(tangent_between(problem.pose, after.pose)[3:]).max() < 0.1:
        assert problem.energy(after.pose) < problem.energy(problem.pose)
    energy = sums.energy(problem.equations, NO_POINTS, BodyPoses.at(CHAIN, after.pose))
    assert after.energy == pytest.approx(energy, rel=1e-9)
    coordinates = space.project(after.pose[ANGLES])
    np.testing.assert_allclose(after.pose[ANGLES], space.angles(coordinates), atol=1e-8)


@given(seed=SEEDS, residual=RESIDUALS, iterations=st.integers(0, 12))
def test_the_trace_decreases_and_the_status_states_why_it_ends(seed: int, residual: Residual, iterations: int) -> None:
    problem = Problem(seed, residual, 0.0)
    problem.pose = within_limits(problem.pose)
    solution = solved(problem, FULL, Prior.none(), SolverOptions(iterations, 1e-5))
    assert len(solution.trace) == solution.iterations + 1
    assert np.all(np.diff(solution.trace) < 0)
    assert solution.trace[-1] == solution.energy
    assert solution.trace[0] == pytest.approx(sums.energy(problem.equations, NO_POINTS, problem.bodies), rel=1e-9)
    if solution.status == SolverStatus.ITERATION_LIMIT:
        assert solution.iterations == iterations
        assert not solution.converged
    else:
        assert solution.converged


def test_undetermined_parameters_are_singular() -> None:
    problem = Problem(3, "plane", 0.0)
    sums.clear(problem.equations, problem.bodies)
    solution = solved(problem, FULL, Prior.none(), SolverOptions(5, 0.0, pose_damping=0.0))
    assert solution.status == SolverStatus.SINGULAR
    assert solution.iterations == 0
    assert not solution.converged


def _pulled_up(by: float) -> Problem:
    """Return correspondences that bend all fingers by `by`, from 0.05 rad below their limits."""
    problem = Problem(0, "point", 0.0)
    problem.pose[ANGLES] = UPPER - 0.05
    target = problem.pose.copy()
    target[ANGLES] += by
    now, then = (
        HAND.transform_points(pose, np.maximum(problem.correspondences.body, 0), problem.local)
        for pose in (problem.pose, target)
    )
    problem.cloud.points[:] = problem.correspondences.x + then - now
    return _nearly_met(problem, 1.0)


def test_angles_stay_within_the_limits() -> None:
    pulled = solved(_pulled_up(0.3), FULL, Prior.none(), SolverOptions(10, 1e-6))
    assert np.all(pulled.pose[ANGLES] <= UPPER)
    assert np.mean(pulled.pose[ANGLES] > UPPER - 1e-3) > 0.6


def test_limit_avoidance_slows_only_motion_towards_a_limit() -> None:
    def bent(by: float, avoid: bool) -> float:
        """Return the mean bend after two steps, rad."""
        problem = _pulled_up(by)
        solution = solved(problem, FULL, Prior.none(), SolverOptions(2, 1e-5, avoid_limits=avoid))
        return float(np.mean(solution.pose[ANGLES] - problem.pose[ANGLES]))

    assert bent(0.03, avoid=False) == pytest.approx(0.03, rel=0.1)
    assert bent(0.03, avoid=True) < 0.75 * bent(0.03, avoid=False)
    assert bent(-0.03, avoid=True) == pytest.approx(-0.03, rel=0.2)


@given(seed=SEEDS, count=st.integers(1, 20))
def test_the_synergy_prior_equals_probabilistic_components(seed: int, count: int) -> None:
    synergies = load_synergies().truncated(count)
    prior = Prior.from_synergies(synergies, 1e-6)
    covariance = synergies.components * synergies.variances @ synergies.components.T + np.radians(2) ** 2 * np.eye(20)
    np.testing.assert_allclose(prior.precision @ covariance, 1e-6 * np.eye(20), atol=1e-12)
    pose = random_pose(np.random.default_rng(seed))
    doubled = prior.scaled(2.0)
    for space in (FULL, PostureSubspace.of(load_synergies("leap-grasps"), 4)):
        size = 6 + space.basis.shape[1]
        A, b = np.zeros((size, size)), np.zeros(size)
        pull = reduced_precision(doubled, space)
        energy = add_prior(pose, doubled, space, pull, A, b)
        away = pose[ANGLES] - synergies.mean
        assert energy == pytest.approx(away @ prior.precision @ away)
        np.testing.assert_allclose(A[6:, 6:], 2 * space.basis.T @ prior.precision @ space.basis, atol=1e-15)
        np.testing.assert_allclose(b[6:], 2 * space.basis.T @ prior.precision @ away, atol=1e-12)
        assert not A[:6].any()
