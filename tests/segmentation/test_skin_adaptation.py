"""Segmentation by colour: hysteresis against a flood fill, and adaptation to the light."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.geometry.rectangle import Rect
from depthtrack.segmentation.chroma import BINS, bins_of_colours
from depthtrack.segmentation.components import components_with
from depthtrack.segmentation.options import SkinColourOptions
from depthtrack.segmentation.skin_adaptation import (
    MAYBE_SKIN,
    NOT_SKIN,
    SURELY_SKIN,
    AdaptiveSkin,
)
from depthtrack.segmentation.skin_colour import SkinColourModel, chroma_distribution
from depthtrack.segmentation.skin_statistics import OTHER, SKIN, Mixture

OPTIONS = SkinColourOptions()


def bin_of(r: int, g: int, b: int) -> tuple[int, int]:
    """Return the U and V bin of a colour."""
    u, v = divmod(
        int(bins_of_colours(OPTIONS.darkest, OPTIONS.brightest)[(r >> 3) << 10 | (g >> 3) << 5 | b >> 3]), BINS
    )
    return u, v


@given(seed=st.integers(0, 2**32 - 1))
def test_hysteresis_equals_a_flood_fill(seed: int) -> None:
    rng = np.random.default_rng(seed)
    classes = rng.choice([NOT_SKIN, MAYBE_SKIN, SURELY_SKIN], (9, 13), p=[0.55, 0.4, 0.05]).astype(np.uint8)
    expected = classes == SURELY_SKIN
    while True:
        padded = np.pad(expected, 1)
        near = np.any([padded[1 + j : 10 + j, 1 + i : 14 + i] for j in (-1, 0, 1) for i in (-1, 0, 1)], axis=0)
        grown = expected | (near & (classes == MAYBE_SKIN))
        if np.array_equal(grown, expected):
            break
        expected = grown
    np.testing.assert_array_equal(components_with(classes, SURELY_SKIN) > 0, expected)


def test_chroma_of_a_mixture_equals_that_of_its_samples() -> None:
    """The mixture is one Gaussian well inside the colour cube."""
    mixture = Mixture(np.array([[150.0, 110.0, 90.0]]), np.array([[300.0, 100.0, 200.0]]), np.array([1.0]))
    rgb = np.random.default_rng(1).normal(mixture.means, np.sqrt(mixture.variances), (200_000, 3))
    u = 128 - 0.168736 * rgb[:, 0] - 0.331264 * rgb[:, 1] + 0.5 * rgb[:, 2]
    v = 128 + 0.5 * rgb[:, 0] - 0.418688 * rgb[:, 1] - 0.081312 * rgb[:, 2]
    drawn, _, _ = np.histogram2d(u, v, bins=BINS, range=[[0, 256], [0, 256]])
    np.testing.assert_allclose(chroma_distribution(mixture), drawn / drawn.sum(), atol=2e-3)


def test_published_mixtures_are_complete() -> None:
    for mixture in (SKIN, OTHER):
        assert mixture.means.shape == mixture.variances.shape == (16, 3)
        assert mixture.weights.sum() == pytest.approx(1)
        assert mixture.variances.min() > 0
    # Skin is redder than green and greener than blue in every one of its Gaussians.
    assert np.all(np.diff(SKIN.means, axis=1) < 0)


def one_colour(colour: tuple[int, int, int], is_skin: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return an image (20, 30, 3) of one colour, its mask of skin and its mask of the hand."""
    image = np.full((20, 30, 3), colour, np.uint8)
    return image, np.full((20, 30), is_skin, np.uint8), np.full((20, 30), is_skin)


def test_adaptation_is_the_published_blend() -> None:
    skin, region, colour = AdaptiveSkin(SkinColourModel.default()), Rect(0, 0, 30, 20), (120, 110, 130)
    u, v = bin_of(*colour)
    before = skin.posterior()
    image, found, hand = one_colour(colour, is_skin=True)
    skin.adapt(image, region, found, hand)
    after = skin.posterior()
    assert after[u, v] == pytest.approx(OPTIONS.offline_weight * before[u, v] + 1 - OPTIONS.offline_weight)
    # Other colours keep their probability.
    after[u, v] = before[u, v]
    np.testing.assert_allclose(after, before)


def test_adaptation_ends_after_its_window() -> None:
    skin, region, colour = AdaptiveSkin(SkinColourModel.default()), Rect(0, 0, 30, 20), (205, 150, 125)
    u, v = bin_of(*colour)
    before = skin.posterior()[u, v]
    image, nothing, nowhere = one_colour(colour, is_skin=False)
    skin.adapt(image, region, nothing, nowhere)
    assert skin.posterior()[u, v] == pytest.approx(OPTIONS.offline_weight * before)
    for _ in range(OPTIONS.adaptation_frames):
        skin.adapt(np.zeros((20, 30, 3), np.uint8), region, nothing, nowhere)
    assert skin.posterior()[u, v] == pytest.approx(before)
    skin.adapt(image, region, nothing, nowhere)
    skin.reset()
    assert skin.posterior()[u, v] == pytest.approx(before)


def test_skin_outside_the_hand_is_left_out() -> None:
    """A face and the arm have the colour of skin but are not the hand."""
    skin, region = AdaptiveSkin(SkinColourModel.default()), Rect(0, 0, 30, 20)
    before = skin.posterior()
    skin.adapt(
        np.full((20, 30, 3), (205, 150, 125), np.uint8),
        region,
        np.ones((20, 30), np.uint8),
        np.zeros((20, 30), np.bool_),
    )
    np.testing.assert_allclose(skin.posterior(), before, atol=1e-15)


def test_skin_among_some_pixels_equals_that_among_blocks_of_one_pixel() -> None:
    rng = np.random.default_rng(4)
    image = rng.integers(0, 256, (30, 40, 3), dtype=np.uint8)
    image[5:20, 5:25] = (200, 140, 120)
    skin, region = AdaptiveSkin(SkinColourModel.default()), Rect(3, 4, 33, 28)
    pixels = rng.random(region.shape) < 0.8
    found = skin.find_among(image, region, pixels)
    np.testing.assert_array_equal(found, skin.find(image, region, pixels.view(np.uint8), 1) > 0)
    assert found.any()
    assert not found[~pixels].any()
