"""Random numbers of a frame, and the check of a start pose."""

import numpy as np
from numpy.typing import ArrayLike

from depthtrack.errors import InputError
from depthtrack.hand.pose import POSE_SIZE
from depthtrack.types import Array


def frame_generator(seed: int, frame_index: int) -> np.random.Generator:
    """Return the random number generator of one frame: Philox keyed by seed and frame.

    It does not depend on earlier frames.
    """
    return np.random.Generator(np.random.Philox(key=[seed, frame_index]))


def checked_pose(pose: ArrayLike) -> Array:
    """Return a start pose (27,) as an array.

    Raises:
        InputError: if the shape is not (27,), or a number is not finite.
    """
    given = np.asarray(pose, dtype=np.float64)
    if given.shape != (POSE_SIZE,) or not np.all(np.isfinite(given)):
        raise InputError(f"a start pose must be {POSE_SIZE} finite numbers, found shape {given.shape}")
    return given
