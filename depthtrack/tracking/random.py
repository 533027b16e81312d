"""What every tracker begins a frame with: random numbers of the frame's own, and the pose that a user gives."""

import numpy as np
from numpy.typing import ArrayLike

from depthtrack.errors import InputError
from depthtrack.hand.pose import POSE_SIZE
from depthtrack.types import Array


def frame_generator(seed: int, frame_index: int) -> np.random.Generator:
    """Random numbers of one frame, whatever happened before: Philox keyed by seed and frame."""
    return np.random.Generator(np.random.Philox(key=[seed, frame_index]))


def checked_pose(pose: ArrayLike) -> Array:
    """A start pose (27,) as an array. Raises InputError for another shape, or numbers that are not finite."""
    given = np.asarray(pose, dtype=np.float64)
    if given.shape != (POSE_SIZE,) or not np.all(np.isfinite(given)):
        raise InputError(f"a start pose must be {POSE_SIZE} finite numbers, found shape {given.shape}")
    return given
