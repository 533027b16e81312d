"""The search for layouts: the tree, the swarm on the skin, exchanges, threads."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.benchmarks.papers.schroeder2015_greedy import WholeEvaluation, next_better
from depthtrack.errors import InputError
from depthtrack.markers.layout.exchange import exchanged, greedy_layout
from depthtrack.markers.layout.nearest import Tree, nearest_rows
from depthtrack.markers.layout.options import LayoutOptions
from depthtrack.markers.layout.quality import LayoutQuality
from depthtrack.markers.layout.search import find_layout_of
from depthtrack.markers.layout.surface_swarm import SurfaceSwarm
from depthtrack.solver.options import SwarmOptions
from depthtrack.types import Index

SMALL = LayoutOptions(swarm=SwarmOptions(particles=60, generations=15), kicks=1)


def energy_of(quality: LayoutQuality, rows: Index) -> float:
    return float(quality.energies(rows[None])[0])


@given(seed=st.integers(0, 2**32 - 1), count=st.sampled_from([1, 2, 7, 9, 100, 400]))
def test_the_tree_finds_the_nearest_point(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    points, queries = rng.normal(size=(count, 3)), 2 * rng.normal(size=(20, 3))
    rows = np.empty(20, np.int64)
    nearest_rows(Tree.of(points), queries, rows)
    distance = np.linalg.norm(queries[:, None] - points, axis=-1)
    np.testing.assert_allclose(distance[np.arange(20), rows], distance.min(axis=1))


def test_particles_stay_on_the_skin(quality: LayoutQuality) -> None:
    swarm, rng = SurfaceSwarm(quality, 4), np.random.default_rng(0)
    position = swarm.confined(rng.normal(scale=0.1, size=(20, 12)))
    velocity, before = np.zeros_like(position), position.copy()
    swarm.advance(position, velocity, before[::-1].copy(), before[3], rng.random((2, 20, 12)), SwarmOptions())
    np.testing.assert_array_equal(velocity, position - before)
    np.testing.assert_array_equal(swarm.positions(swarm.rows(position)), position)
    moved = position.copy()
    swarm.randomise(moved, before[3], rng, SwarmOptions(randomise=0.5))
    changed = (moved != position).reshape(20, 4, 3).any(axis=2)
    assert changed.sum(axis=1).max() == 1
    assert changed.sum() <= 10


def test_the_same_seed_gives_the_same_layout_on_any_number_of_threads(quality: LayoutQuality) -> None:
    found = [find_layout_of(quality, 4, SMALL, seed=5, threads=threads) for threads in (1, 2, 5)]
    for other in found[1:]:
        np.testing.assert_array_equal(found[0].rows, other.rows)
        assert found[0].energy == other.energy
    assert found[0].energy == pytest.approx(quality.energies(found[0].rows[None])[0], rel=1e-12)


def test_no_exchange_improves_the_layout(quality: LayoutQuality) -> None:
    found = find_layout_of(quality, 4, SMALL)
    for k in range(4):
        others = np.repeat(found.rows[None], len(quality.candidates), axis=0)
        others[:, k] = np.arange(len(quality.candidates))
        assert quality.energies(others).min() >= found.energy - 1e-9


def test_the_search_is_never_worse_than_the_greedy_choice(quality: LayoutQuality) -> None:
    few = LayoutOptions(swarm=SwarmOptions(particles=2, generations=1), kicks=0)
    for count in (4, 6):
        assert find_layout_of(quality, count, few).energy <= energy_of(quality, greedy_layout(quality, count).rows)


def test_a_swarm_with_a_greedy_particle_is_never_worse_than_the_greedy_choice(quality: LayoutQuality) -> None:
    few = LayoutOptions(swarm=SwarmOptions(particles=3, generations=2), exchange=False)
    alone = find_layout_of(quality, 4, replace(few, greedy_particle=False))
    greedy = energy_of(quality, greedy_layout(quality, 4).rows)
    assert find_layout_of(quality, 4, few).energy <= greedy < alone.energy


def test_sums_and_bounds_leave_the_greedy_choice_unchanged(quality: LayoutQuality) -> None:
    whole = WholeEvaluation.like(quality)
    np.testing.assert_array_equal(greedy_layout(whole, 4).rows, greedy_layout(quality, 4).rows)
    assert whole.evaluated[0] > 7 * len(quality.candidates)


def test_no_next_vertex_is_better(quality: LayoutQuality) -> None:
    whole = WholeEvaluation.like(quality)
    found = next_better(whole, quality.candidates.random_rows(3, np.random.default_rng(0)))
    assert found.energy == pytest.approx(quality.energies(found.rows[None])[0], rel=1e-12)
    for k in range(3):
        assert quality.grown(np.delete(found.rows, k)).min() >= found.energy - 1e-9


def test_exchanges_begin_where_the_swarm_ended(quality: LayoutQuality) -> None:
    swarm = find_layout_of(quality, 4, replace(SMALL, exchange=False))
    assert exchanged(quality, swarm.rows).energy <= swarm.energy


def test_the_greedy_layout_has_distinct_markers(quality: LayoutQuality) -> None:
    found = greedy_layout(quality, 5)
    assert len(set(found.rows)) == 5
    assert quality.terms(found.rows).distance > 0.005


def test_too_few_markers_are_rejected(quality: LayoutQuality) -> None:
    with pytest.raises(InputError, match="needs 2 to 64 markers"):
        find_layout_of(quality, 1, SMALL)
