"""A hand may lie behind an occluder, and pays for lying before it or inside it."""

import math
from dataclasses import replace

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rectangle import Rect
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.objective import evaluate
from depthtrack.rendering.options import Objective
from depthtrack.rendering.raster import RasterScorer
from depthtrack.rendering.seen_sums import seen_sums
from depthtrack.rendering.target import Target
from tests.support.rendering import random_poses, target_of, window_on

LINE = Camera(6, 1, 10.0, 10.0, 0.0, 0.0)


def test_pixels_before_an_object_or_inside_it_are_told_from_those_behind() -> None:
    # behind it | within the tolerance | before it | no object there | nothing drawn
    occluder = np.array([[0.400, 0.498, 0.520, 0.000, 0.400]], np.float32)
    rendered = np.array([[0.500, 0.500, 0.500, 0.500, 0.000]], np.float32)
    camera = Camera(5, 1, 10.0, 10.0, 0.0, 0.0)
    target = Target(camera, np.zeros((1, 5), bool), np.zeros((1, 5), np.float32), occluder=occluder)
    np.testing.assert_array_equal(target.unhidden(rendered, 0.005) > 0, [[False, True, True, True, False]])
    before = target.before_occluder(rendered, 0.005)
    np.testing.assert_array_equal(before, [[False, True, True, False, False]])
    from_depth = target.hidden_from(0.005)
    np.testing.assert_array_equal((from_depth > 0) & (rendered > 0) & (from_depth < 1 / 0.5), before)


def test_surroundings_hide_a_hand_but_cost_nothing() -> None:
    # behind them | within the tolerance | before them | nothing there | nothing drawn | inside an object's front
    surroundings = np.array([[0.400, 0.498, 0.520, 0.000, 0.400, 0.400]], np.float32)
    occluder = np.array([[0.000, 0.000, 0.000, 0.000, 0.000, 0.600]], np.float32)
    rendered = np.array([[0.500, 0.500, 0.500, 0.500, 0.000, 0.500]], np.float32)
    maps = np.zeros((1, 6), bool), np.zeros((1, 6), np.float32)
    target = Target(LINE, *maps, surroundings=surroundings)
    np.testing.assert_array_equal(target.unhidden(rendered, 0.005) > 0, [[False, True, True, True, False, False]])
    assert target.before_occluder(rendered, 0.005) is None
    both = replace(target, occluder=occluder)
    np.testing.assert_array_equal(both.unhidden(rendered, 0.005) > 0, [[False, True, True, True, False, True]])
    np.testing.assert_array_equal(both.before_occluder(rendered, 0.005), occluder > 0)
    near = rendered - np.float32(0.2)
    assert both.unhidden(near, 0.005) is near
    assert Target(LINE, *maps).unhidden(rendered, 0.005) is rendered
    # Hypotheses are scored without what lies behind the surroundings; an object hides in its own way.
    np.testing.assert_array_equal(target.before_surroundings(rendered, 0.005), target.unhidden(rendered, 0.005))
    np.testing.assert_array_equal(both.before_surroundings(rendered, 0.005)[:, 5], rendered[:, 5])
    for each in (target, both):
        seen = each.before_surroundings(rendered, 0.005) > 0
        np.testing.assert_array_equal((rendered > 0) & (1 / np.maximum(rendered, 1e-3) > each.seen_from(0.005)), seen)
        assert not each.seen_from(math.inf).any()
    cropped = both.crop(Rect.of_size(1, 0, 3, 1))
    np.testing.assert_array_equal(cropped.hiding, surroundings[:, 1:4])


@pytest.mark.parametrize("with_object", [False, True])
def test_the_sums_of_what_is_seen_are_those_of_the_unhidden_map(with_object: bool) -> None:
    rng = np.random.default_rng(7)
    shape, objective = (40, 30), Objective(before_cost=0.7)
    silhouette = rng.random(shape) < 0.5

    def depths(share: float) -> np.ndarray:
        return np.where(rng.random(shape) < share, 0.5 + 0.03 * rng.normal(size=shape), 0).astype(np.float32)

    rendered, observed = depths(0.7), depths(0.8) * silhouette
    maps = {"surroundings": depths(0.6) * ~silhouette, "occluder": depths(0.4) * ~silhouette if with_object else None}
    target = Target(Camera(30, 40, 10.0, 10.0, 0.0, 0.0), silhouette, observed, **maps)
    seen, before = target.unhidden(rendered, 0.005), target.before_occluder(rendered, 0.005)
    assert (seen != rendered).sum() > 50
    limits, sums = (objective.match_depth, objective.clamp_depth, objective.before_cost, 0.005), np.empty(3)
    occluder = np.zeros_like(rendered) if target.occluder is None else target.occluder
    assert target.hiding is not None
    assert seen_sums(rendered, silhouette, observed, target.hiding, occluder, limits, sums)
    np.testing.assert_allclose(sums, evaluate(objective, silhouette, observed, seen, before), rtol=1e-12)
    far = rendered - np.float32(0.4) * (rendered > 0)
    assert not seen_sums(far, silhouette, observed, target.hiding, occluder, limits, sums)


@pytest.mark.parametrize("cost", [0.0, 0.25, 1.0, 4.0])
def test_pixels_before_an_object_cost_more_than_those_outside_the_silhouette(cost: float) -> None:
    # before it | before it, in the silhouette without a reading | behind it or beside it | seen hand | nothing
    silhouette = np.array([[False, True, False, True, False]])
    observed = np.array([[0.0, 0.0, 0.0, 0.5, 0.0]])
    rendered = np.array([[0.5, 0.5, 0.5, 0.5, 0.0]])
    before = np.array([[True, True, False, False, False]])
    clamped, matched_silhouette, union = evaluate(Objective(before_cost=cost), silhouette, observed, rendered, before)
    assert clamped == pytest.approx(3 * 0.04 + 2 * cost * 0.04)
    assert (matched_silhouette, union) == (2, 4 + cost)


def test_a_pose_behind_an_object_scores_as_without_it_and_one_before_it_costs_more() -> None:
    rng = np.random.default_rng(5)
    shape, poses = HandShape(), random_poses(rng, 6, (0, 0, 0.5), 0.02)
    target = target_of(shape, poses[0], window_on(shape, poses[0], 96), rng)
    energies = []
    for depth in (None, 0.3, 0.8):
        occluder = None if depth is None else np.full(target.camera.shape, depth, np.float32)
        with RasterScorer(shape) as scorer:
            scorer.set_target(replace(target, occluder=occluder))
            energies.append(scorer.score(poses))
    np.testing.assert_array_equal(energies[0], energies[1])
    assert (energies[2] > energies[0] + 1).all()


@pytest.mark.parametrize("cost", [-0.1, 101, np.nan])
def test_costs_beyond_their_range_are_rejected(cost: float) -> None:
    with pytest.raises(InputError, match="before_cost must be from 0 to 100"):
        Objective(before_cost=cost)


def test_an_occluder_is_cropped_and_reduced_with_the_target() -> None:
    camera = Camera(40, 30, 50.0, 50.0, 20.0, 15.0)
    occluder = (np.arange(1200).reshape(30, 40) / 1200).astype(np.float32)
    target = Target(camera, np.zeros(camera.shape, bool), occluder, occluder=occluder)
    for changed in (target.crop(Rect.of_size(10, 5, 20, 10)), target.reduced(13)):
        assert changed.occluder is not None
        np.testing.assert_array_equal(changed.occluder, changed.depth)


@pytest.mark.parametrize("wrong", [np.zeros((2, 6)), np.full((1, 6), -1.0), np.full((1, 6), np.nan)])
def test_occluders_without_valid_depth_are_rejected(wrong: np.ndarray) -> None:
    with pytest.raises(ValueError, match="the occluder map must"):
        Target(LINE, np.zeros((1, 6), bool), np.zeros((1, 6), np.float32), occluder=wrong)
