"""Morphology: discs against OpenCV, components against scipy."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import label

from depthtrack.segmentation.morphology import bounding_box, dilated, disc, eroded, without_small_components


@pytest.mark.parametrize("radius", [1, 2, 3, 4, 5])
def test_square_and_diamond_equal_a_disc(radius: int) -> None:
    mask = np.random.default_rng(radius).random((40, 50)) < 0.02
    np.testing.assert_array_equal(dilated(mask, radius), cv2.dilate(mask.astype(np.uint8), disc(radius)) > 0)
    np.testing.assert_array_equal(eroded(~mask, radius), cv2.erode((~mask).astype(np.uint8), disc(radius)) > 0)


@given(seed=st.integers(0, 2**32 - 1))
def test_small_components_are_removed(seed: int) -> None:
    mask = np.random.default_rng(seed).random((20, 30)) < 0.3
    labels, count = label(mask, np.ones((3, 3)))
    areas = [np.sum(labels == number) for number in range(1, count + 1)]
    kept = [number for number, area in enumerate(areas, 1) if area >= 0.2 * max(areas)]
    np.testing.assert_array_equal(without_small_components(mask, 0.2), np.isin(labels, kept))


def test_bounding_boxes_end_at_the_image() -> None:
    mask = np.zeros((20, 30), np.bool_)
    mask[3:6, 10:12] = True
    assert tuple(bounding_box(mask, 4)) == (6, 0, 16, 10)
