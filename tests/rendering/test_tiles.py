"""The tiled layout of images keeps every pixel, and the rasteriser skips no tile."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.raster import hand_constants as constants
from depthtrack.rendering.raster.tiles import TILE_PIXELS, new_tiled_image, read_depth, tile_counts, write_tiled
from tests.support.rendering import KINECT, assert_agrees, random_poses, random_shape, target_of


@given(height=st.integers(1, 70), width=st.integers(1, 70), seed=st.integers(0, 99))
def test_a_stored_image_is_read_back(height: int, width: int, seed: int) -> None:
    image = np.random.default_rng(seed).normal(size=(height, width)).clip(0).astype(np.float32)
    tiled = new_tiled_image(image.shape)
    assert tiled.ctypes.data % 64 == 0
    columns, rows = tile_counts(image.shape)
    assert tiled.size == columns * rows * TILE_PIXELS
    write_tiled(image, np.nan, tiled)
    depth = np.divide(1, image, out=np.zeros_like(image), where=image > 0)
    np.testing.assert_array_equal(read_depth(tiled, image.shape), depth)
    assert np.count_nonzero(np.isnan(tiled)) == tiled.size - image.size


def test_a_tile_is_two_rows_of_eight_pixels_and_the_next_tile_is_below() -> None:
    image = np.arange(6 * 24).reshape(6, 24)
    tiled = new_tiled_image(image.shape)
    write_tiled(image, 0, tiled)
    np.testing.assert_array_equal(tiled[:TILE_PIXELS], image[:2, :8].ravel())
    np.testing.assert_array_equal(tiled[TILE_PIXELS : 2 * TILE_PIXELS], image[2:4, :8].ravel())
    np.testing.assert_array_equal(tiled[3 * TILE_PIXELS : 4 * TILE_PIXELS], image[:2, 8:16].ravel())


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=6)
def test_large_hands_lose_no_tile(seed: int) -> None:
    """A hand fills the image, so that all its parts are large, at every angle."""
    rng = np.random.default_rng(seed)
    shape, poses = random_shape(rng), random_poses(rng, 2, (0, 0, rng.uniform(0.2, 0.4)), 0.03)
    assert_agrees(shape, target_of(shape, poses[0], KINECT, rng), poses)


@pytest.mark.parametrize("scale", [0.7, 1.3])
def test_the_bounding_radius_encloses_the_hand(scale: float) -> None:
    shape = HandShape().with_(scale=scale)
    radius = constants.hand_constants(shape)[8 * constants.BOUNDING_RADIUS]
    poses = random_poses(np.random.default_rng(1), 500, (0, 0, 0), 0)
    farthest = np.linalg.norm(HandModel(shape).keypoints(poses), axis=-1).max() + scale * shape.radii.max()
    assert farthest < radius < 2 * farthest
