"""Search spaces of a swarm: the 27 pose parameters, or the tangent space of a pose."""

from typing import Protocol

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.hand.compiled_tangent import retract_unnormalised
from depthtrack.hand.limits import LOWER, UPPER, within_limits
from depthtrack.hand.pose import ANGLES, ORIENTATION, POSE_SIZE, TANGENT_SIZE, tangent_between
from depthtrack.types import Array

POSITION_RANGE = 0.5
"""Metres, half side of the box of positions: only a diverged swarm reaches it."""


class SwarmSpace(Protocol):
    """Coordinates of poses for a swarm, with their bounds, and the maps to poses and back."""

    lower: Array
    upper: Array
    fingers: slice

    def poses(self, coordinates: Array) -> Array:
        """Return the poses (N, 27) at coordinates (N, D)."""
        ...

    def coordinates(self, poses: Array) -> Array:
        """Return the coordinates (N, D) of poses (N, 27)."""
        ...


class ParameterSpace:
    """Space of the 27 pose parameters (Oikonomidis et al. 2011, Sec. 2.4).

    The quaternion is redundant.
    """

    fingers = ANGLES

    def __init__(self, reference: Array) -> None:
        self.lower = np.concatenate([reference[:3] - POSITION_RANGE, np.full(4, -1.0), LOWER])
        self.upper = np.concatenate([reference[:3] + POSITION_RANGE, np.full(4, 1.0), UPPER])
        self._quaternion = reference[ORIENTATION]

    def poses(self, coordinates: Array) -> Array:
        # A quaternion of length zero has no orientation: it gets that of the reference.
        poses = coordinates.copy()
        length = np.linalg.norm(poses[:, ORIENTATION], axis=1, keepdims=True)
        usable = length > 1e-6
        poses[:, ORIENTATION] = np.where(usable, poses[:, ORIENTATION] / np.where(usable, length, 1), self._quaternion)
        return poses

    def coordinates(self, poses: Array) -> Array:
        # Of the two quaternions of a rotation, the one nearer to that of the reference.
        flip = np.sign(poses[:, ORIENTATION] @ self._quaternion)[:, None]
        coordinates = poses.copy()
        coordinates[:, ORIENTATION] *= np.where(flip == 0, 1, flip)
        return coordinates


class TangentSpace:
    """Steps from a reference pose: 26 dimensions, a rotation vector in place of the quaternion."""

    fingers = slice(6, TANGENT_SIZE)

    def __init__(self, reference: Array) -> None:
        self.reference = within_limits(reference)
        reach = np.concatenate([np.full(3, POSITION_RANGE), np.full(3, np.pi)])
        self.lower = np.concatenate([-reach, LOWER - self.reference[ANGLES]])
        self.upper = np.concatenate([reach, UPPER - self.reference[ANGLES]])

    def poses(self, coordinates: Array) -> Array:
        poses = np.empty((len(coordinates), POSE_SIZE))
        retract_batch(self.reference, coordinates, poses)
        return poses

    def coordinates(self, poses: Array) -> Array:
        return tangent_between(np.broadcast_to(self.reference, poses.shape), poses)


@compiled()
def retract_batch(reference: Array, steps: Array, poses: Array) -> None:
    """Write the poses (N, 27) reached from `reference` (27,) by steps (N, 26) to `poses`."""
    for n in range(steps.shape[0]):
        retract_unnormalised(reference, steps[n], poses[n])
