"""The distribution of common postures, and its term of the objective."""

from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.hand.common_postures import PostureDistribution, add_posture_costs, common_postures
from depthtrack.hand.pose import ANGLES
from depthtrack.hand.shape import HandShape
from depthtrack.hand.synergies import load_synergies
from depthtrack.rendering.objective import Terms
from depthtrack.rendering.options import Objective
from depthtrack.rendering.raster import RasterScorer
from tests.support.rendering import random_poses, target_of, window_on


def test_the_precision_inverts_the_covariance_of_synergies_and_residual() -> None:
    synergies = load_synergies().truncated(4)
    C, spread = synergies.components, 0.2
    covariance = C * synergies.variances @ C.T + spread**2 * np.eye(20)
    found = PostureDistribution.of(synergies, spread)
    np.testing.assert_allclose(found.precision @ covariance, np.eye(20), atol=1e-5)
    np.testing.assert_array_equal(found.mean, synergies.mean)


@given(seed=st.integers(0, 2**32 - 1), weight=st.floats(0, 10))
def test_costs_are_squared_distances(seed: int, weight: float) -> None:
    rng = np.random.default_rng(seed)
    poses, energies = random_poses(rng, 5, (0, 0, 0.5), 0.1), rng.normal(size=5)
    mean, precision = common_postures()
    away = poses[:, ANGLES] - mean
    expected = energies + weight * np.einsum("bi,ij,bj->b", away, precision, away)
    add_posture_costs(poses, mean, precision, weight, energies)
    np.testing.assert_allclose(energies, expected, rtol=1e-12, atol=1e-12)


def test_scorers_add_the_term_to_the_published_energy() -> None:
    rng = np.random.default_rng(3)
    shape, poses = HandShape(), random_poses(rng, 6, (0, 0, 0.5), 0.02)
    target = target_of(shape, poses[0], window_on(shape, poses[0], 96), rng)
    weighted = replace(Objective(), posture_weight=0.5)
    costs = np.zeros(len(poses))
    add_posture_costs(poses, *common_postures(), 0.5, costs)
    with RasterScorer(shape) as published, RasterScorer(shape, weighted) as scorer:
        published.set_target(target)
        scorer.set_target(target)
        np.testing.assert_allclose(scorer.score(poses), published.score(poses) + costs, rtol=1e-12)
        np.testing.assert_allclose(scorer.terms(poses).energy, scorer.score(poses), rtol=1e-6)
        np.testing.assert_array_equal(scorer.evaluate(poses).agreement, published.evaluate(poses).agreement)


def test_terms_of_sums_hold_the_same_energy() -> None:
    rng = np.random.default_rng(4)
    poses, sums = random_poses(rng, 3, (0, 0, 0.5), 0.02), rng.uniform(10, 20, (3, 3))
    costs = np.zeros(3)
    add_posture_costs(poses, *common_postures(), 2.0, costs)
    published = Terms.of_sums(Objective(), poses, *sums.T).energy
    np.testing.assert_allclose(Terms.of_sums(Objective(posture_weight=2.0), poses, *sums.T).energy, published + costs)
