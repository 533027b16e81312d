"""How the rasteriser keeps images, and that it leaves no block of them out."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.raster import layout
from depthtrack.rendering.raster.tiles import BLOCK, new_stripes, read_stripes, stripe_counts, write_stripes
from tests.support.rendering import KINECT, assert_agrees, random_poses, random_shape, target_of


@given(height=st.integers(1, 70), width=st.integers(1, 70), seed=st.integers(0, 99))
def test_images_come_back_as_they_were_stored(height: int, width: int, seed: int) -> None:
    image = np.random.default_rng(seed).normal(size=(height, width)).astype(np.float32)
    stored = new_stripes(image.shape)
    assert stored.ctypes.data % 64 == 0
    tiles, blocks = stripe_counts(image.shape)
    assert stored.size == tiles * blocks * BLOCK
    write_stripes(image, np.nan, stored)
    np.testing.assert_array_equal(read_stripes(stored, image.shape), image)
    assert np.count_nonzero(np.isnan(stored)) == stored.size - image.size


def test_a_block_is_two_rows_of_eight_and_the_next_is_below() -> None:
    image = np.arange(6 * 24).reshape(6, 24)
    stored = new_stripes(image.shape)
    write_stripes(image, 0, stored)
    np.testing.assert_array_equal(stored[:BLOCK], image[:2, :8].ravel())
    np.testing.assert_array_equal(stored[BLOCK : 2 * BLOCK], image[2:4, :8].ravel())
    np.testing.assert_array_equal(stored[3 * BLOCK : 4 * BLOCK], image[:2, 8:16].ravel())


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=6)
def test_large_hands_lose_no_block(seed: int) -> None:
    """A hand that fills the image: all its parts are large, at every angle."""
    rng = np.random.default_rng(seed)
    shape, poses = random_shape(rng), random_poses(rng, 2, (0, 0, rng.uniform(0.2, 0.4)), 0.03)
    assert_agrees(shape, target_of(shape, poses[0], KINECT, rng), poses)


@pytest.mark.parametrize("scale", [0.7, 1.3])
def test_nothing_of_the_hand_is_out_of_its_reach(scale: float) -> None:
    shape = HandShape().with_(scale=scale)
    reach = layout.constants(shape)[8 * layout.REACH]
    poses = random_poses(np.random.default_rng(1), 500, (0, 0, 0), 0)
    farthest = np.linalg.norm(HandModel(shape).keypoints(poses), axis=-1).max() + scale * shape.radii.max()
    assert farthest < reach < 2 * farthest
