"""Hands of random sizes."""

import numpy as np

from depthtrack.hand.shape import HandShape
from depthtrack.synthesis.random_hand import random_hand


def test_hands_are_drawn_from_the_prior_and_differ() -> None:
    one, other = random_hand("left", 1.1, 1), random_hand("left", 1.1, 2)
    assert (one.side, one.scale) == ("left", 1.1)
    assert not np.allclose(one.lengths, other.lengths)
    assert one == random_hand("left", 1.1, 1)


def test_the_share_scales_the_differences_from_the_average() -> None:
    whole, half, none = (random_hand("right", None, 5, share) for share in (1.0, 0.5, 0.0))
    np.testing.assert_allclose(np.log(whole.scale), 2 * np.log(half.scale))
    np.testing.assert_array_equal(none.lengths, HandShape().lengths)
    assert none.scale == 1
