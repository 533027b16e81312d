"""An occluder hides what lies behind it, and only there."""

from dataclasses import replace

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rectangle import Rect
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.objective import evaluate
from depthtrack.rendering.options import Objective
from depthtrack.rendering.oracle import OracleScorer
from depthtrack.rendering.raster import RasterScorer
from depthtrack.rendering.target import Target
from tests.support.rendering import random_poses, target_of, window_on, with_occluder

LINE = Camera(6, 1, 10.0, 10.0, 0.0, 0.0)


def test_sums_of_a_hand_counted_image_behind_an_occluder() -> None:
    # behind it | within the tolerance | before it | no object there | seen hand | nothing drawn
    occluder = np.array([[0.400, 0.498, 0.520, 0.000, 0.000, 0.400]], np.float32)
    rendered = np.array([[0.500, 0.500, 0.500, 0.500, 0.500, 0.000]])
    observed = np.array([[0.000, 0.000, 0.000, 0.000, 0.500, 0.000]], np.float32)
    target = Target(LINE, observed > 0, observed, occluder=occluder)
    visible = target.unhidden(rendered, 0.005)
    np.testing.assert_array_equal(visible > 0, [[False, True, True, True, True, False]])
    np.testing.assert_array_equal(target.hidden_from(0.005) < 1 / 0.5, visible > 0)
    clamped, matched_silhouette, union = evaluate(Objective(), target.silhouette, target.depth, visible)
    assert clamped == pytest.approx(3 * 0.040)
    assert (matched_silhouette, union) == (1, 4)


@pytest.mark.parametrize("cost", [0.0, 0.25, 1.0])
def test_hidden_pixels_count_as_a_share_of_pixels_outside_the_silhouette(cost: float) -> None:
    # hidden | hidden, in the silhouette without a reading | hidden, with one | only observed | seen hand | nothing
    silhouette = np.array([[False, True, True, True, True, False]])
    observed = np.array([[0.0, 0.0, 0.03, 0.5, 0.5, 0.0]])
    hidden = np.array([[True, True, True, False, False, False]])
    visible = np.array([[0.0, 0.0, 0.0, 0.0, 0.5, 0.0]])
    clamped, matched_silhouette, union = evaluate(Objective(hidden_cost=cost), silhouette, observed, visible, hidden)
    assert clamped == pytest.approx(2 * cost * 0.04 + (0.03 + cost * 0.01) + 0.04)
    assert (matched_silhouette, union) == (1, 4 + cost)


def test_hidden_pixels_at_full_cost_score_like_those_of_no_occluder() -> None:
    rng = np.random.default_rng(5)
    shape, poses = HandShape(), random_poses(rng, 6, (0, 0, 0.5), 0.02)
    target = with_occluder(target_of(shape, poses[0], window_on(shape, poses[0], 96), rng), 0.45, rng)
    energies = []
    for occluder, cost in ((None, 0.0), (target.occluder, 1.0), (target.occluder, 0.0)):
        with RasterScorer(shape, Objective(hidden_cost=cost)) as scorer:
            scorer.set_target(replace(target, occluder=occluder))
            energies.append(scorer.score(poses))
    np.testing.assert_allclose(energies[0], energies[1], rtol=1e-5)
    assert np.abs(energies[0] - energies[2]).max() > 0.1


@pytest.mark.parametrize("cost", [-0.1, 1.1, np.nan])
def test_costs_of_hidden_pixels_beyond_their_range_are_rejected(cost: float) -> None:
    with pytest.raises(InputError, match="objective hidden_cost must lie between 0 and 1"):
        Objective(hidden_cost=cost)


def test_a_hand_half_behind_an_object_scores_like_the_visible_half() -> None:
    shape, pose = HandShape(), random_poses(np.random.default_rng(4), 1, (0, 0, 0.5), 0.0)
    camera = window_on(shape, pose[0], 128)
    with OracleScorer(shape, Objective(hidden_cost=0.0)) as oracle:
        oracle.set_target(Target.blank(camera))
        depth = oracle.render(pose[0])
        left = np.tile(np.arange(128) < 64, (128, 1))
        seen = np.where(left, depth, np.float32(0)).astype(np.float32)
        before = np.where(left, 0, 0.3).astype(np.float32)
        energies = []
        for occluder in (None, before):
            oracle.set_target(Target(camera, seen > 0, seen, occluder=occluder))
            energies.append(oracle.terms(pose))
    assert energies[1].depth[0] < 1e-3
    assert energies[1].silhouette[0] == 0
    assert energies[0].energy[0] > energies[1].energy[0] + 10


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
