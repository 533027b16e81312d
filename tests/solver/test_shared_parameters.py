"""Elimination of a pose from shared normal equations, held to the whole system."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.hand.limits import LOWER, UPPER
from depthtrack.solver.shared_parameters import eliminate_pose, solve_free

SEEDS = st.integers(0, 2**32 - 1)


@given(seed=SEEDS, shared=st.integers(1, 6), views=st.integers(1, 3))
def test_elimination_gives_the_step_of_the_whole_system(seed: int, shared: int, views: int) -> None:
    """A few views with poses of their own, and the shared parameters, as one dense system."""
    rng = np.random.default_rng(seed)
    damping, n = np.full(26, 0.1), 26 * views + shared
    whole, gradient = np.zeros((n, n)), np.zeros(n)
    parts = []
    for view in range(views):
        J = rng.normal(size=(80, 26 + shared))
        H, g = J.T @ J, J.T @ rng.normal(size=80)
        at = np.r_[26 * view : 26 * view + 26, 26 * views : n]
        whole[np.ix_(at, at)] += H
        gradient[at] += g
        own = np.arange(26 * view, 26 * view + 26)
        whole[own, own] += damping
        parts.append(eliminate_pose(H, g, (LOWER + UPPER) / 2, damping))
    expected = np.linalg.solve(whole, -gradient)
    information = np.sum([part.information for part in parts], axis=0)
    change = np.linalg.solve(information, -np.sum([part.gradient for part in parts], axis=0))
    np.testing.assert_allclose(change, expected[26 * views :], atol=1e-9)
    for view, part in enumerate(parts):
        step = part.step + part.step_by_shared @ change
        np.testing.assert_allclose(step, expected[26 * view : 26 * view + 26], atol=1e-9)


@given(seed=SEEDS)
def test_an_angle_pushed_beyond_its_limit_is_held(seed: int) -> None:
    rng = np.random.default_rng(seed)
    J = rng.normal(size=(60, 28))
    H, g = J.T @ J, J.T @ rng.normal(size=60)
    angles = np.where(rng.random(20) < 0.5, UPPER, LOWER)
    part = eliminate_pose(H, g, angles, np.full(26, 0.1))
    pushed = np.where(angles == UPPER, g[6:26] < 0, g[6:26] > 0)
    assert not part.step[6:][pushed].any()
    assert not part.step_by_shared[6:][pushed].any()
    assert part.step[6:][~pushed].all()


@given(seed=SEEDS, size=st.integers(2, 8))
def test_held_parameters_stay(seed: int, size: int) -> None:
    rng = np.random.default_rng(seed)
    J, b = rng.normal(size=(size + 3, size)), rng.normal(size=size)
    A, held = J.T @ J, rng.random(size) < 0.4
    x = solve_free(A, b, held)
    assert not x[held].any()
    np.testing.assert_allclose((A @ x)[~held], b[~held], atol=1e-9 * np.abs(A).max() * max(1, np.abs(x).max()))
