"""Several threads give the bits of one, and no thread survives its scorer."""

import gc
import threading

import numpy as np
import pytest

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


def test_a_small_batch_starts_no_thread(poses: np.ndarray, targets: list[Target]) -> None:
    before = raster_threads()
    with RasterScorer(HandShape(), threads=2) as scorer:
        scorer.set_target(targets[0])
        scorer.score(poses[:64])
        assert raster_threads() <= before
