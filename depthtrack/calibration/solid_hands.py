"""Sizes that give one solid hand: a fit to few views may let fingers grow together."""

import numpy as np

from depthtrack.errors import InputError
from depthtrack.hand.shape import Side
from depthtrack.hand.size_parameters import LENGTHS, hand_of
from depthtrack.hand.skin.mesh import Skin
from depthtrack.types import Array

_KEPT = 0.9
"""Share of their difference from the average that sizes keep in one step towards it."""
_MOST_STEPS = 40


def is_solid(values: Array, side: Side) -> bool:
    """Return whether sizes (35,) give one solid hand with five free fingers."""
    try:
        Skin.of(hand_of(values, side))
    except InputError:
        return False
    return True


def nearest_solid(values: Array, side: Side) -> Array:
    """Return sizes (35,) moved towards those of the average hand until they give a solid hand.

    The scale is kept.
    """
    towards_average = values.copy()
    for _ in range(_MOST_STEPS):
        if is_solid(towards_average, side):
            return towards_average
        towards_average[LENGTHS.start :] *= _KEPT
    return np.where(np.arange(len(values)) < LENGTHS.start, values, 0.0)


def solid_step(values: Array, change: Array, side: Side) -> Array:
    """Return sizes (35,) after the largest of `change` and its halves that keeps the hand solid."""
    for halves in range(4):
        if is_solid(moved := values + change / 2**halves, side):
            return moved
    return values
