"""The rasteriser agrees with the float64 oracle: silhouettes, depth and energies."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from depthtrack.errors import InputError
from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rectangle import Rect
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.options import Objective
from depthtrack.rendering.oracle import OracleScorer
from depthtrack.rendering.raster import RasterScorer
from depthtrack.rendering.target import Target
from tests.support.rendering import (
    KINECT,
    assert_agrees,
    random_poses,
    random_shape,
    target_of,
    window_on,
    with_occluder,
    with_surroundings,
)


@given(seed=st.integers(0, 2**32 - 1), reduced=st.sampled_from([None, 96, 64, 33]))
@settings(max_examples=20)
def test_agrees_with_the_oracle_in_a_region_of_the_hand(seed: int, reduced: int | None) -> None:
    rng = np.random.default_rng(seed)
    shape, poses = random_shape(rng), random_poses(rng, 5, (0.02, -0.01, 0.5), 0.02)
    target = target_of(shape, poses[0], window_on(shape, poses[0], 224), rng)
    assert_agrees(shape, target if reduced is None else target.reduced(reduced), poses)


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=10)
def test_agrees_with_the_oracle_through_any_camera(seed: int) -> None:
    rng = np.random.default_rng(seed)
    width, height = (int(n) for n in rng.integers(1, 200, 2))
    focal = rng.uniform(0.5, 2) * max(width, height)
    camera = Camera(width, height, focal, focal * rng.uniform(0.8, 1.2), *rng.uniform(-0.5, 1.5, 2) * [width, height])
    shape, poses = random_shape(rng), random_poses(rng, 4, (0, 0, rng.uniform(0.3, 2.5)), 0.2)
    assert_agrees(shape, target_of(shape, poses[0], camera, rng), poses, Objective(0.015, 0.06, 5.0, 2.0))


@given(seed=st.integers(0, 2**32 - 1), reduced=st.sampled_from([None, 96, 33]), cost=st.sampled_from([0.0, 0.3, 4.0]))
@settings(max_examples=20)
def test_agrees_with_the_oracle_behind_an_occluder(seed: int, reduced: int | None, cost: float) -> None:
    rng = np.random.default_rng(seed)
    shape, poses = random_shape(rng), random_poses(rng, 5, (0.02, -0.01, 0.5), 0.02)
    target = with_occluder(target_of(shape, poses[0], window_on(shape, poses[0], 224), rng), 0.5, rng)
    objective = Objective(hidden_depth=0.003, before_cost=cost)
    assert_agrees(shape, target if reduced is None else target.reduced(reduced), poses, objective)


@given(seed=st.integers(0, 2**32 - 1), reduced=st.sampled_from([None, 96, 33]), with_object=st.booleans())
@settings(max_examples=20)
def test_agrees_with_the_oracle_behind_other_readings(seed: int, reduced: int | None, with_object: bool) -> None:
    rng = np.random.default_rng(seed)
    shape, poses = random_shape(rng), random_poses(rng, 5, (0.02, -0.01, 0.5), 0.02)
    target = target_of(shape, poses[0], window_on(shape, poses[0], 224), rng)
    target = with_surroundings(with_occluder(target, 0.5, rng) if with_object else target, 0.48, rng)
    assert_agrees(shape, target if reduced is None else target.reduced(reduced), poses, Objective())


def test_what_other_readings_hide_costs_nothing() -> None:
    rng = np.random.default_rng(4)
    shape, poses = HandShape(), random_poses(rng, 6, (0, 0, 0.5), 0.02)
    target = target_of(shape, poses[0], window_on(shape, poses[0], 96), rng)
    near = np.full(target.camera.shape, 0.2, np.float32)
    energies = {}
    for name, surroundings, depth in (("free", None, 0.02), ("hidden", near, 0.02), ("never", near, math.inf)):
        objective = Objective(kinematic_weight=0.0, surroundings_depth=depth)
        with RasterScorer(shape, objective) as scorer:
            scorer.set_target(replace(target, surroundings=surroundings))
            energies[name] = scorer.score(poses)
            empty = target.depth.clip(0, objective.clamp_depth).sum(dtype=np.float64) / np.count_nonzero(
                target.silhouette
            )
    np.testing.assert_array_equal(energies["free"], energies["never"])
    # Nothing of a hidden hand is drawn: the depth and the silhouette of the observation remain.
    np.testing.assert_allclose(energies["hidden"], 1e3 * empty + 20.0, rtol=1e-4)


def test_an_occluder_before_the_hand_changes_no_bit() -> None:
    rng = np.random.default_rng(8)
    shape, poses = HandShape(), random_poses(rng, 40, (0, 0, 0.5), 0.05)
    target = target_of(shape, poses[0], window_on(shape, poses[0], 224), rng)
    scores = []
    for occluder in (None, *(np.full(target.camera.shape, depth, np.float32) for depth in (0, 0.2))):
        with RasterScorer(shape) as scorer:
            scorer.set_target(replace(target, occluder=occluder))
            scores.append(scorer.score(poses))
    np.testing.assert_array_equal(scores[0], scores[1])
    np.testing.assert_array_equal(scores[0], scores[2])


@pytest.mark.parametrize(
    ("name", "centre", "spread"),
    [
        ("behind", (0, 0, -0.6), 0.05),
        ("around the lens", (0, 0, 0.0), 0.08),
        ("1 cm from the lens", (0, 0, 0.01), 0.005),
        ("reaching past the lens", (0, 0, 0.1), 0.05),
        ("at the border", (0.24, 0.18, 0.5), 0.03),
        ("outside", (3.0, 0, 0.5), 0.1),
    ],
)
@pytest.mark.parametrize("seed", range(4))
def test_agrees_with_the_oracle_in_extreme_views(
    name: str, centre: tuple[float, float, float], spread: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    camera = KINECT.resized(0.25)
    shape, poses = random_shape(rng), random_poses(rng, 6, centre, spread)
    target = target_of(shape, random_poses(rng, 1, (0, 0, 0.4), 0)[0], camera, rng)
    if name in ("behind", "outside"):
        fast = RasterScorer(shape)
        fast.set_target(target)
        assert not any(fast.render(pose).any() for pose in poses)
    assert_agrees(shape, target, poses)


def test_a_region_observes_nothing_outside_the_image() -> None:
    """A region across the image's edge scores like that of a larger image with empty edges."""
    rng = np.random.default_rng(7)
    shape, poses = HandShape(), random_poses(rng, 6, (0.25, 0.2, 0.5), 0.02)
    full = target_of(shape, poses[0], KINECT, rng)
    region = full.crop(Rect.of_size(500, 380, 300, 300))
    assert not region.depth[100:].any()
    assert not region.silhouette[:, 140:].any()
    assert_agrees(shape, region, poses)


def test_the_best_pose_is_the_observed_one() -> None:
    rng = np.random.default_rng(3)
    shape, poses = HandShape(), random_poses(rng, 20, (0, 0, 0.5), 0.02)
    camera = window_on(shape, poses[4], 224)
    oracle = OracleScorer(shape)
    oracle.set_target(Target.blank(camera))
    depth = oracle.render(poses[4])
    scorer = RasterScorer(shape)
    scorer.set_target(Target(camera, depth > 0, depth))
    terms = scorer.terms(poses)
    assert terms.energy.argmin() == 4
    assert terms.depth[4] < 0.01  # what remains is the float32 of the rendered depth
    assert terms.silhouette[4] == 0
    np.testing.assert_array_equal(scorer.evaluate(poses).agreement, terms.agreement)


def test_scores_do_not_depend_on_previous_scores() -> None:
    """The buffer is cleared after every call, also if the region changes."""
    rng = np.random.default_rng(5)
    shape, poses = HandShape(), random_poses(rng, 40, (0, 0, 0.4), 0.3)
    small = target_of(shape, poses[0], window_on(shape, poses[0], 70), rng)
    large = target_of(shape, poses[0], KINECT.resized(0.5), rng)
    used = RasterScorer(shape)
    for target in (large, small, large):
        fresh = RasterScorer(shape)
        used.set_target(target)
        fresh.set_target(target)
        np.testing.assert_array_equal([used.score(p[None])[0] for p in poses], fresh.score(poses))


@pytest.mark.parametrize("poses", [np.zeros(27), np.zeros((2, 26)), np.full((1, 27), np.nan)])
def test_poses_of_a_wrong_shape_are_rejected(poses: np.ndarray) -> None:
    scorer = RasterScorer(HandShape())
    scorer.set_target(
        target_of(
            HandShape(),
            random_poses(np.random.default_rng(0), 1, (0, 0, 0.5), 0)[0],
            KINECT.resized(0.1),
            np.random.default_rng(0),
        )
    )
    with pytest.raises(ValueError, match="poses must be"):
        scorer.score(poses)


def test_memory_of_other_images_changes_no_bit() -> None:
    rng = np.random.default_rng(11)
    shape, poses = random_shape(rng), random_poses(rng, 5, (0.02, -0.01, 0.5), 0.02)
    with RasterScorer(shape) as used:
        for size in (224, 97, 230, 64, 300, 101):
            target = target_of(shape, poses[0], window_on(shape, poses[0], size), rng)
            used.set_target(target)
            with RasterScorer(shape) as new:
                new.set_target(target)
                np.testing.assert_array_equal(used.score(poses), new.score(poses))
                np.testing.assert_array_equal(used.render(poses[1]), new.render(poses[1]))


def test_scoring_without_a_target_is_an_error() -> None:
    with pytest.raises(RuntimeError, match="set_target"):
        RasterScorer(HandShape()).score(np.zeros((1, 27)))


def test_thread_counts_out_of_range_are_rejected() -> None:
    with pytest.raises(InputError, match="threads"):
        RasterScorer(HandShape(), threads=0)


@given(seed=st.integers(0, 2**32 - 1), side=st.integers(1, 300))
def test_reduced_targets_keep_the_field_of_view(seed: int, side: int) -> None:
    """Every sample of a reduced target is the full one's value along the same ray."""
    rng = np.random.default_rng(seed)
    width, height = (int(n) for n in rng.integers(2, 120, 2))
    camera = Camera(width, height, 150.0, 140.0, 30.0, 40.0)
    depth = rng.uniform(0.1, 1, camera.shape).astype(np.float32)
    full = Target(camera, depth > 0.5, depth)
    reduced = full.reduced(side)
    assume(reduced is not full)
    assert max(reduced.camera.shape) <= side
    v, u = (int(n) for n in rng.integers(0, reduced.camera.shape))
    looks_at = camera.project(reduced.camera.unproject([u, v], 1.0))
    nearest = np.clip(np.rint(looks_at).astype(int), 0, [camera.width - 1, camera.height - 1])
    around = depth[max(nearest[1] - 1, 0) : nearest[1] + 2, max(nearest[0] - 1, 0) : nearest[0] + 2]
    assert reduced.depth[v, u] in around


def test_an_invisible_hand_scores_the_same_everywhere() -> None:
    camera = KINECT.resized(0.1)
    nothing = Target.blank(camera)
    pose = random_poses(np.random.default_rng(0), 1, (0, 0, -1), 0)
    assert_agrees(HandShape(), nothing, pose)
