"""Morphology: discs against OpenCV."""

import cv2
import numpy as np
import pytest

from depthtrack.segmentation.morphology import bounding_box, closed, dilated, disc, eroded


@pytest.mark.parametrize("radius", [1, 2, 3, 4, 5])
def test_square_and_diamond_equal_a_disc(radius: int) -> None:
    mask = np.random.default_rng(radius).random((40, 50)) < 0.02
    np.testing.assert_array_equal(dilated(mask, radius), cv2.dilate(mask.astype(np.uint8), disc(radius)) > 0)
    np.testing.assert_array_equal(eroded(~mask, radius), cv2.erode((~mask).astype(np.uint8), disc(radius)) > 0)


@pytest.mark.parametrize("radius", [1, 2, 5, 6])
def test_closing_is_that_by_a_disc(radius: int) -> None:
    mask = np.random.default_rng(radius).random((40, 50)) < 0.1
    expected = cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_CLOSE, disc(radius)) > 0
    np.testing.assert_array_equal(closed(mask, radius), expected)


def test_bounding_boxes_end_at_the_image() -> None:
    mask = np.zeros((20, 30), np.bool_)
    mask[3:6, 10:12] = True
    assert tuple(bounding_box(mask, 4)) == (6, 0, 16, 10)
