"""EGL and OSMesa agree with the float64 oracle and each other: silhouettes, depth, energies."""

import multiprocessing
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from depthtrack.errors import InputError
from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rectangle import Rect
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.primitives import Primitives
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.objective import evaluate
from depthtrack.rendering.opengl.context import OpenGLError
from depthtrack.rendering.opengl.impostors import HandTable, place_impostors
from depthtrack.rendering.opengl.opening import open_context
from depthtrack.rendering.opengl.scorer import OpenGLScorer, Sums
from depthtrack.rendering.opengl.sums import sum_tiles
from depthtrack.rendering.options import Objective
from depthtrack.rendering.raycast import raycast
from depthtrack.rendering.target import Target
from tests.support import opengl_views as views
from tests.support.rendering import KINECT, random_poses, random_shape, target_of, window_on

Run = Callable[..., Any]


def _try(platform: Any) -> str | None:
    try:
        open_context(platform).close()
    except OpenGLError as error:
        return str(error)
    return None


@pytest.fixture(scope="session")
def osmesa() -> Iterator[Run]:
    """Return a function that runs another with "osmesa" as first argument, in a spawned process."""
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        if problem := pool.submit(_try, "osmesa").result():
            pytest.skip(problem)
        yield lambda function, *arguments: pool.submit(function, "osmesa", *arguments).result()


@pytest.fixture(scope="session")
def egl() -> Run:
    """Return a function that runs another with "egl" as first argument, in this process."""
    if problem := _try("egl"):
        pytest.skip(problem)
    return lambda function, *arguments: function("egl", *arguments)


@pytest.fixture(scope="session", params=["egl", "osmesa"])
def run(request: pytest.FixtureRequest) -> Run:
    """Return the function of each platform in turn."""
    runner: Run = request.getfixturevalue(request.param)
    return runner


@given(seed=st.integers(0, 2**32 - 1), reduced=st.sampled_from([None, 96, 64, 33]))
@settings(max_examples=12)
def test_agrees_with_the_oracle_in_a_region_of_the_hand(run: Run, seed: int, reduced: int | None) -> None:
    run(views.assert_window_agrees, seed, reduced)


@given(seed=st.integers(0, 2**32 - 1), cost=st.sampled_from([0.0, 0.3, 4.0]))
@settings(max_examples=8)
def test_agrees_with_the_oracle_behind_an_occluder(run: Run, seed: int, cost: float) -> None:
    run(views.assert_occluded_window_agrees, seed, cost)


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=15)
def test_agrees_with_the_oracle_through_any_camera(run: Run, seed: int) -> None:
    run(views.assert_any_camera_agrees, seed)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", views.ABSURD)
def test_agrees_with_the_oracle_in_extreme_views(run: Run, name: str, seed: int) -> None:
    run(views.assert_absurd_view_agrees, name, seed)


def test_agrees_with_the_oracle_in_regions_outside_the_image(run: Run) -> None:
    run(views.assert_overhanging_windows_agree)


@pytest.mark.parametrize("seed", range(3))
def test_egl_in_software_and_osmesa_give_the_same_bits(egl: Run, osmesa: Run, seed: int) -> None:
    if not OpenGLScorer(HandShape()).software:
        pytest.skip("EGL draws on a GPU here, which rounds in its own way")
    for ours, theirs in zip(egl(views.energies_and_depth, seed), osmesa(views.energies_and_depth, seed), strict=True):
        np.testing.assert_array_equal(ours, theirs)


@pytest.mark.usefixtures("egl")
@pytest.mark.parametrize("sums", ["cpu", "gpu"])
def test_a_score_does_not_depend_on_the_rest_of_the_batch(sums: Sums) -> None:
    """Hands extend over all borders of their tiles without effect on other tiles."""
    rng = np.random.default_rng(5)
    shape, poses = random_shape(rng), random_poses(rng, 40, (0, 0, 0.35), 0.08)
    target = target_of(shape, poses[0], KINECT.crop(Rect.of_size(250, 180, 301, 203)), rng)
    with OpenGLScorer(shape, sums=sums) as scorer:
        scorer.set_target(target)
        together = scorer.score(poses)
        alone = np.concatenate([scorer.score(pose[None]) for pose in poses])
        np.testing.assert_array_equal(together, alone)
        np.testing.assert_array_equal(scorer.score(poses[::-1]), together[::-1])
        assert scorer.score(poses[:0]).shape == (0,)


@pytest.mark.usefixtures("egl")
@pytest.mark.parametrize("sums", ["cpu", "gpu"])
@pytest.mark.parametrize(("width", "height"), [(1, 1), (3, 257), (5, 7), (1500, 20), (64, 64)])
def test_the_sums_of_an_empty_image_are_exact_at_any_size(sums: Sums, width: int, height: int) -> None:
    rng = np.random.default_rng(width)
    silhouette = rng.random((height, width)) < 0.3
    depth = rng.choice(np.array([0, 0.015625, 0.5], np.float32), size=(height, width))
    poses = random_poses(rng, 7, (0, 0, -1), 0.1)
    with OpenGLScorer(HandShape(), sums=sums) as scorer:
        scorer.set_target(Target(Camera(width, height, 60, 60, 0, 0), silhouette, depth))
        terms = scorer.terms(poses)
    clamped = np.minimum(depth, 0.04, dtype=np.float64).sum()
    np.testing.assert_allclose(terms.depth, 1000 * clamped / (silhouette.sum() + 1e-6), rtol=1e-6)
    np.testing.assert_array_equal(terms.silhouette, 1.0)


@pytest.mark.usefixtures("egl")
def test_regions_too_large_for_the_renderer_are_rejected() -> None:
    from depthtrack.rendering.opengl.renderer import shared_renderer

    renderer = shared_renderer("egl")
    with renderer.context as gl, pytest.raises(InputError, match=r"at most \d+ pixels a side"):
        renderer.grid(gl, 10, renderer.context.max_side + 1)


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=15)
def test_rectangles_bound_their_primitives_tightly(seed: int) -> None:
    """The ray caster's pixels of each primitive lie in its rectangle and touch all four sides."""
    rng = np.random.default_rng(seed)
    shape, camera = random_shape(rng), KINECT
    poses = random_poses(rng, 1, (0, 0, 0.5), 0.02)
    instances, regions = np.empty((37, 6, 4), np.float32), np.empty((1, 4), np.int64)
    intrinsics = camera.fx, camera.fy, camera.cx, camera.cy
    assert place_impostors(poses, HandTable.of(shape), intrinsics, camera.shape, 1, instances, regions) == 37
    primitives = Primitives.of(shape)
    T = primitives.transforms(HandModel(shape).transforms(poses[0]))
    for k in range(37):
        v, u = np.nonzero(raycast(camera, primitives.kinds[k : k + 1], T[k : k + 1], np.zeros(1, np.int64)).depth)
        if not len(u):  # a cone seen from its wide end hides its wall
            continue
        left, top, right, bottom = instances[k, 0]
        assert left <= u.min()
        assert u.max() < right
        assert top <= v.min()
        assert v.max() < bottom
        if primitives.kinds[k] == 0:  # cylinders show only the wall between their ends
            assert max(u.min() - left, right - 1 - u.max(), v.min() - top, bottom - 1 - v.max()) <= 1
    assert tuple(regions[0]) == (*instances[:, 0, :2].min(0), *instances[:, 0, 2:].max(0))


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=15)
def test_the_kernel_sums_tiles_like_the_plain_evaluation(seed: int) -> None:
    rng, objective = np.random.default_rng(seed), Objective(before_cost=0.3)
    h, w, columns, count = *(int(n) for n in rng.integers(1, 40, 2)), 3, 5
    depth = np.where(rng.random((h, w)) < 0.2, 0, rng.uniform(0.4, 0.5, (h, w))).astype(np.float32)
    silhouette = rng.random((h, w)) < 0.5
    rendered = np.where(rng.random((count, h, w)) < 0.4, 0, depth + rng.uniform(-0.06, 0.06, (count, h, w)))
    rendered = np.clip(rendered, 0, None).astype(np.float32)
    tiles = np.zeros((2 * h, columns * w), np.float32)
    for n in range(count):
        inverse = np.divide(1, rendered[n], out=np.zeros((h, w), np.float32), where=rendered[n] > 0)
        tiles[n // columns * h :, n % columns * w :][:h, :w] = inverse
    regions, sums = np.tile([0, 0, w, h], (count, 1)), np.empty((count, 3))
    empty = float(np.minimum(depth, objective.clamp_depth).sum(dtype=np.float64)), 0.0, float(silhouette.sum())
    limits = objective.match_depth, objective.clamp_depth, objective.before_cost
    occluder = np.where(rng.random((h, w)) < 0.3, rng.uniform(0.4, 0.5, (h, w)), 0)
    around = np.where(rng.random((h, w)) < 0.3, rng.uniform(0.4, 0.5, (h, w)), 0)
    target = Target(Camera(w, h, 60, 60, 0, 0), silhouette, depth, occluder=occluder, surroundings=around)
    hiding = target.hidden_from(objective.hidden_depth), target.seen_from(objective.surroundings_depth)
    maps = depth, silhouette.astype(np.float32), *hiding
    sum_tiles(tiles, columns, regions, *maps, empty, *limits, sums)
    seen = [target.before_surroundings(image, objective.surroundings_depth) for image in rendered]
    before = [target.before_occluder(image, objective.hidden_depth) for image in seen]
    expected = [evaluate(objective, silhouette, depth, *maps) for maps in zip(seen, before, strict=True)]
    np.testing.assert_allclose(sums, expected, rtol=1e-5, atol=1e-5)


@pytest.mark.usefixtures("egl")
def test_the_observed_pose_scores_best() -> None:
    rng = np.random.default_rng(3)
    shape, poses = HandShape(), random_poses(rng, 20, (0, 0, 0.5), 0.02)
    camera = window_on(shape, poses[4], 224)
    with OpenGLScorer(shape) as scorer:
        scorer.set_target(Target.blank(camera))
        depth = scorer.render(poses[4])
        scorer.set_target(Target(camera, depth > 0, depth))
        terms = scorer.terms(poses)
    assert terms.energy.argmin() == 4
    np.testing.assert_allclose(terms.energy[4], 10 * terms.kinematic[4], atol=1e-4)
