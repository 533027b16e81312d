"""Several threads give the bits of one, and no thread survives its scorer."""

import gc
import threading

import numpy as np
import pytest

from depthtrack.geometry.camera import PRESETS
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.raster import RasterScorer
from depthtrack.rendering.target import Target
from tests.support.rendering import random_poses, target_of, window_on


@pytest.fixture(scope="module")
def poses() -> np.ndarray:
    return random_poses(np.random.default_rng(2), 700, (0, 0, 0.5), 0.1)


@pytest.fixture(scope="module")
def targets(poses: np.ndarray) -> list[Target]:
    """Return targets of the first pose, 40 and 96 pixels wide."""
    rng, shape = np.random.default_rng(3), HandShape()
    return [target_of(shape, poses[0], window_on(shape, poses[0], side), rng) for side in (40, 96)]


def raster_threads() -> set[threading.Thread]:
    return {thread for thread in threading.enumerate() if thread.name.startswith("depthtrack-raster")}


def assert_ends(threads: set[threading.Thread]) -> None:
    """Check that the threads end; the long limit allows for a busy machine."""
    for thread in threads:
        thread.join(120)
        assert not thread.is_alive()


@pytest.mark.parametrize("threads", [2, 3])
def test_the_number_of_threads_does_not_change_the_energies(
    threads: int, poses: np.ndarray, targets: list[Target]
) -> None:
    with RasterScorer(HandShape()) as one, RasterScorer(HandShape(), threads=threads) as many:
        for count in (3, 700, 1, 0, 300, 65, 2):
            for target in targets:
                one.set_target(target)
                many.set_target(target)
                for _ in range(3):
                    np.testing.assert_array_equal(one.score(poses[:count]), many.score(poses[:count]))
                assert one.score(poses[:count]).shape == (count,)


def test_closing_a_scorer_ends_its_threads(poses: np.ndarray, targets: list[Target]) -> None:
    before = raster_threads()
    with RasterScorer(HandShape(), threads=3) as scorer:
        scorer.set_target(targets[1])
        scorer.score(poses)
        own = raster_threads() - before
        assert 1 <= len(own) <= 2
    assert_ends(own)


def test_a_scorer_that_is_not_closed_ends_its_threads(poses: np.ndarray, targets: list[Target]) -> None:
    before = raster_threads()
    scorer = RasterScorer(HandShape(), threads=3)
    scorer.set_target(targets[1])
    scorer.score(poses)
    own = raster_threads() - before
    assert own
    del scorer
    gc.collect()
    assert_ends(own)


def test_the_threads_start_with_the_first_large_batch(poses: np.ndarray, targets: list[Target]) -> None:
    before = raster_threads()
    with RasterScorer(HandShape(), threads=2) as scorer:
        scorer.set_target(targets[0])
        scorer.score(poses[:1])
        scorer.score(poses[:8])
        assert raster_threads() <= before
        scorer.score(poses[:64])
        assert raster_threads() - before


def test_a_single_pose_of_a_large_image_starts_no_thread(poses: np.ndarray) -> None:
    before = raster_threads()
    with RasterScorer(HandShape(), threads=2) as scorer:
        scorer.set_target(Target.blank(PRESETS["kinect1"]))
        scorer.score(poses[:1])
        assert raster_threads() <= before


def test_a_scorer_of_one_thread_starts_none(poses: np.ndarray, targets: list[Target]) -> None:
    before = raster_threads()
    with RasterScorer(HandShape()) as scorer:
        scorer.set_target(targets[1])
        scorer.score(poses)
        assert raster_threads() <= before


def test_all_results_are_those_of_one_thread(poses: np.ndarray, targets: list[Target]) -> None:
    with RasterScorer(HandShape()) as one, RasterScorer(HandShape(), threads=2) as many:
        for target in targets:
            one.set_target(target)
            many.set_target(target)
            for expected, found in zip(one.evaluate(poses), many.evaluate(poses), strict=True):
                np.testing.assert_array_equal(expected, found)
            for name, expected in vars(one.terms(poses)).items():
                np.testing.assert_array_equal(expected, getattr(many.terms(poses), name))
            np.testing.assert_array_equal(one.render(poses[0]), many.render(poses[0]))
