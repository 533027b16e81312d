"""Components of masks against scipy."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import label

from depthtrack.segmentation.components import components_with, runs_of, without_small_components


def random_labels(seed: int) -> np.ndarray:
    """Return labels 0 to 2 of a random image."""
    rng = np.random.default_rng(seed)
    return rng.choice(3, rng.integers(1, 30, 2), p=[0.6, 0.3, 0.1]).astype(np.uint8)


@given(seed=st.integers(0, 2**32 - 1))
def test_small_components_are_removed(seed: int) -> None:
    mask = random_labels(seed) > 0
    labels, count = label(mask, np.ones((3, 3)))
    areas = [np.sum(labels == number) for number in range(1, count + 1)]
    kept = [number for number, area in enumerate(areas, 1) if area >= 0.2 * max(areas)]
    np.testing.assert_array_equal(without_small_components(mask, 0.2), np.isin(labels, kept))


@given(seed=st.integers(0, 2**32 - 1))
def test_components_are_those_of_scipy(seed: int) -> None:
    labels = random_labels(seed)
    numbers, count = label(labels > 0, np.ones((3, 3)))
    np.testing.assert_array_equal(
        components_with(labels, 2), np.isin(numbers, np.setdiff1d(numbers[labels == 2], 0)).astype(np.uint8)
    )
    assert len(np.unique(runs_of(labels).root)) == count
