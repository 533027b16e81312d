"""The particle swarm: its step, its randomisation, its bounds, and that it finds minima."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.errors import InputError
from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rotations import normalised
from depthtrack.hand.limits import LOWER, UPPER
from depthtrack.hand.pose import make_pose, retract, tangent_between
from depthtrack.solver.options import SwarmOptions, constriction
from depthtrack.solver.swarm import Box, advance, keep_better, keep_lowest, minimise, randomise
from depthtrack.solver.swarm_space import ParameterSpace, SwarmSpace, TangentSpace
from depthtrack.tracking.visible_centroid import visible_centroid

seeds = st.integers(0, 2**32 - 1)


def test_the_constriction_equals_that_of_clerc_and_kennedy() -> None:
    assert constriction(2.8, 1.3) == pytest.approx(0.7298, abs=5e-5)
    with pytest.raises(InputError, match="exceed 4"):
        constriction(2.0, 2.0)


@given(seed=seeds)
def test_a_step_equals_equations_3_and_4(seed: int) -> None:
    rng = np.random.default_rng(seed)
    x, v, own = rng.normal(size=(3, 5, 4))
    best, lower, upper = rng.normal(size=4), np.full(4, -0.5), np.full(4, 0.7)
    r = rng.random((2, 5, 4))
    expected_v = 0.7 * (v + 2.8 * r[0] * (own - x) + 1.3 * r[1] * (best - x))
    expected_x = np.clip(x + expected_v, lower, upper)
    advance(x, v, own, best, r, lower, upper, 2.8, 1.3, 0.7)
    np.testing.assert_allclose(v, expected_v, atol=1e-14)
    np.testing.assert_allclose(x, expected_x, atol=1e-14)


@given(seed=seeds, share=st.floats(0, 1), near=st.sampled_from([0.0, 0.5]))
def test_randomisation_moves_one_finger_dimension_of_its_share(seed: int, share: float, near: float) -> None:
    rng = np.random.default_rng(seed)
    lower, upper = np.full(10, -1.0), np.full(10, 2.0)
    before = rng.uniform(-1, 2, (16, 10))
    after = before.copy()
    randomise(after, before[0], lower, upper, slice(4, 10), rng, SwarmOptions(randomise=share, near_best=near))
    changed = before != after
    assert not changed[:, :4].any()
    assert changed.sum(axis=1).max(initial=0) <= 1
    assert changed.sum() == round(share * 16)
    assert np.all((after >= lower) & (after <= upper))


@given(seed=seeds, near=st.sampled_from([0.0, 0.5]))
def test_randomisation_equals_the_plain_rule(seed: int, near: float) -> None:
    rng = np.random.default_rng(seed)
    lower, upper, options = np.full(10, -1.0), np.linspace(0, 2, 10), SwarmOptions(near_best=near)
    before = rng.uniform(lower, upper, (16, 10))
    after, expected, best = before.copy(), before.copy(), before[0].copy()
    randomise(after, best, lower, upper, slice(4, 10), np.random.default_rng([seed, 1]), options)
    draw = np.random.default_rng([seed, 1])
    count = round(options.randomise * len(before))
    rows, dimension = draw.permutation(len(before))[:count], draw.integers(4, 10, count)
    value = draw.uniform(lower[dimension], upper[dimension])
    if near > 0:
        close = best[dimension] + options.near_spread * draw.standard_normal(count)
        value = np.where(draw.random(count) < near, close, value)
    expected[rows, dimension] = np.clip(value, lower[dimension], upper[dimension])
    np.testing.assert_array_equal(after, expected)


@given(seed=seeds)
def test_each_particle_keeps_the_agreement_of_its_lowest_energy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    energies, agreements = rng.integers(0, 4, (5, 9)).astype(np.float64), rng.random((5, 9))
    least, kept = np.full(9, np.inf), np.zeros(9)
    for energy, agreement in zip(energies, agreements, strict=True):
        keep_lowest(energy, agreement, least, kept)
    np.testing.assert_array_equal(least, energies.min(axis=0))
    np.testing.assert_array_equal(kept, agreements[energies.argmin(axis=0), np.arange(9)])


def test_a_swarm_finds_a_minimum_within_its_bounds() -> None:
    centre = np.array([0.3, -0.2, 5.0, 0.1])  # the third lies outside
    lower, upper = np.full(4, -1.0), np.full(4, 1.0)
    rng = np.random.default_rng(0)
    evaluated = []

    def score(x: np.ndarray) -> np.ndarray:
        assert np.all((x >= lower) & (x <= upper))
        evaluated.append(len(x))
        return ((x - centre) ** 2).sum(axis=1)

    options = SwarmOptions(particles=40, generations=60)
    found = minimise(score, rng.uniform(-3, 3, (40, 4)), Box(lower, upper, slice(2, 4)), rng, options)
    np.testing.assert_allclose(found.position, [0.3, -0.2, 1.0, 0.1], atol=1e-2)
    assert found.energy == score(found.position[None])[0]
    assert sum(evaluated) == 40 * 60 + 1


def test_a_swarm_ends_when_its_time_is_over() -> None:
    rng, evaluated = np.random.default_rng(0), list[int]()

    def score(x: np.ndarray) -> np.ndarray:
        evaluated.append(len(x))
        return (x**2).sum(axis=1)

    box, options = Box(np.full(4, -1.0), np.full(4, 1.0), slice(2, 4)), SwarmOptions(particles=8, generations=20)
    found = minimise(score, rng.uniform(-1, 1, (8, 4)), box, rng, options, is_over=lambda: len(evaluated) == 5)
    assert len(evaluated) == 5
    assert found.energy == score(found.position[None])[0]


def test_the_same_generator_gives_the_same_bits() -> None:
    def run() -> np.ndarray:
        rng = np.random.Generator(np.random.Philox(key=[5, 7]))
        start = rng.normal(size=(12, 26))
        box = Box(np.full(26, -1.0), np.full(26, 1.0), slice(6, 26))
        return minimise(lambda x: (x**2).sum(axis=1), start, box, rng, SwarmOptions()).position

    np.testing.assert_array_equal(run(), run())


@pytest.mark.parametrize("kind", [ParameterSpace, TangentSpace])
@given(seed=seeds)
def test_poses_round_trip_through_search_spaces(kind: type[ParameterSpace] | type[TangentSpace], seed: int) -> None:
    rng = np.random.default_rng(seed)
    reference = make_pose([0, 0, 0.5], rng.normal(size=4), rng.uniform(LOWER, UPPER))
    space: SwarmSpace = kind(reference)
    poses = make_pose(rng.normal(scale=0.05, size=(6, 3)), rng.normal(size=(6, 4)), rng.uniform(LOWER, UPPER, (6, 20)))
    coordinates = space.coordinates(poses)
    assert coordinates.shape == (6, len(space.lower))
    assert np.all(coordinates[:, space.fingers] >= space.lower[space.fingers] - 1e-12)
    np.testing.assert_allclose(tangent_between(poses, space.poses(coordinates)), 0, atol=1e-9)


@given(seed=seeds)
def test_the_tangent_kernel_equals_retract(seed: int) -> None:
    rng = np.random.default_rng(seed)
    reference = make_pose(rng.normal(size=3), rng.normal(size=4), rng.uniform(LOWER, UPPER))
    steps = np.vstack([rng.normal(size=(5, 26)), np.zeros(26)])
    found = TangentSpace(reference).poses(steps)
    found[:, 3:7] = normalised(found[:, 3:7])
    np.testing.assert_allclose(found, retract(np.broadcast_to(reference, (6, 27)), steps), atol=1e-12)


@given(seed=seeds)
def test_the_visible_centroid_is_the_mean_of_the_points(seed: int) -> None:
    rng = np.random.default_rng(seed)
    camera = Camera(20, 10, 30.0, 31.0, 9.0, 4.0)
    depth = np.where(rng.random(camera.shape) < 0.4, rng.uniform(0.2, 1, camera.shape), 0).astype(np.float32)
    depth[0, 0] = 0.5
    v, u = np.nonzero(depth)
    expected = camera.unproject(np.stack([u, v], axis=-1), depth[v, u]).mean(axis=0)
    intrinsics = (camera.fx, camera.fy, camera.cx, camera.cy)
    np.testing.assert_allclose(visible_centroid(depth, intrinsics), expected, atol=1e-9)
    assert np.isnan(visible_centroid(np.zeros_like(depth), intrinsics)).all()


def test_a_zero_quaternion_keeps_the_reference() -> None:
    reference = make_pose([0, 0, 0.5], [0.5, 0.5, 0.5, 0.5], np.zeros(20))
    coordinates = np.concatenate([reference[:3], np.zeros(4), reference[7:]])[None]
    np.testing.assert_allclose(ParameterSpace(reference).poses(coordinates)[0], reference)


@pytest.mark.parametrize("change", [{"particles": 0}, {"generations": -1}, {"randomise": 2.0}, {"randomise_every": -1}])
def test_invalid_options_are_rejected(change: dict[str, float]) -> None:
    with pytest.raises(InputError):
        SwarmOptions(**change)  # type: ignore[arg-type]


@given(seed=st.integers(0, 2**32 - 1))
def test_keeping_the_better_positions_equals_the_plain_rule(seed: int) -> None:
    rng = np.random.default_rng(seed)
    position, own_best = rng.normal(size=(2, 9, 4))
    energy, own_energy = rng.integers(0, 4, (2, 9)).astype(np.float64)  # with equal ones
    expected_best, expected_energy = own_best.copy(), own_energy.copy()
    better = energy < own_energy
    expected_best[better], expected_energy[better] = position[better], energy[better]
    assert keep_better(position, energy, own_best, own_energy) == np.argmin(expected_energy)
    np.testing.assert_array_equal(own_best, expected_best)
    np.testing.assert_array_equal(own_energy, expected_energy)
