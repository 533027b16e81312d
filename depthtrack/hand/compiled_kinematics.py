"""The hand's kinematic chain as the solver needs it: compiled, one pose at a time.

`HandModel` says the same for batches, slowly; the tests hold this file to it.
"""

import math
from typing import NamedTuple

import numba
import numpy as np

from depthtrack.geometry.rotations import compiled_exp, compiled_matrix, compiled_normalised, compiled_product
from depthtrack.hand.kinematics import BODY_COUNT, HandModel
from depthtrack.hand.shape import HandShape
from depthtrack.types import Array


class Chain(NamedTuple):
    """Constants of a hand: `base` (5, 3, 4) T_palm_base with all angles zero, `lengths` (5, 3) m, `mirror` +1 or -1."""

    base: Array
    lengths: Array
    mirror: float

    @staticmethod
    def of(shape: HandShape) -> "Chain":
        """The chain of a hand of these sizes."""
        model = HandModel(shape)
        base = np.ascontiguousarray(model.base_transforms[:, :3])
        return Chain(base, np.ascontiguousarray(model.lengths), shape.mirror)


class BodyPoses(NamedTuple):
    """A posed hand, camera frame: `T` (16, 3, 4) T_camera_body; `axes` and `origins` (20, 3) of the angles' hinges."""

    T: Array
    axes: Array
    origins: Array

    @staticmethod
    def empty() -> "BodyPoses":
        """Room for `forward_kinematics`."""
        return BodyPoses(np.zeros((BODY_COUNT, 3, 4)), np.zeros((20, 3)), np.zeros((20, 3)))

    @staticmethod
    def at(chain: Chain, pose: Array) -> "BodyPoses":
        """The hand in a pose (27,)."""
        bodies = BodyPoses.empty()
        forward_kinematics(chain, np.ascontiguousarray(pose, dtype=np.float64), bodies)
        return bodies


@numba.njit(cache=True, nogil=True)
def forward_kinematics(chain: Chain, pose: Array, bodies: BodyPoses) -> None:
    """Move the bodies to `pose` (27,): Eq. (1) of Schroeder et al. 2014."""
    T, axes, origins = bodies.T, bodies.axes, bodies.origins
    compiled_matrix(pose[3], pose[4], pose[5], pose[6], T[0])
    for i in range(3):
        T[0, i, 3] = pose[i]
    base, lengths = chain.base, chain.lengths
    for finger in range(5):
        first = 1 + 3 * finger
        angle = pose[7 + 4 * finger]
        c, s = math.cos(angle), -chain.mirror * math.sin(angle)
        for i in range(3):
            # Columns of T_palm_base Rz(-mirror abduction), in the camera frame.
            x = T[0, i, 0] * base[finger, 0, 0] + T[0, i, 1] * base[finger, 1, 0] + T[0, i, 2] * base[finger, 2, 0]
            y = T[0, i, 0] * base[finger, 0, 1] + T[0, i, 1] * base[finger, 1, 1] + T[0, i, 2] * base[finger, 2, 1]
            z = T[0, i, 0] * base[finger, 0, 2] + T[0, i, 1] * base[finger, 1, 2] + T[0, i, 2] * base[finger, 2, 2]
            p = T[0, i, 0] * base[finger, 0, 3] + T[0, i, 1] * base[finger, 1, 3] + T[0, i, 2] * base[finger, 2, 3]
            T[first, i, 0] = x * c + y * s
            T[first, i, 1] = y * c - x * s
            T[first, i, 2] = z
            T[first, i, 3] = p + T[0, i, 3]
            axes[4 * finger, i] = -chain.mirror * z
            origins[4 * finger, i] = T[first, i, 3]
        for k in range(3):
            body, hinge = first + k, 4 * finger + 1 + k
            angle = pose[7 + hinge]
            c, s = math.cos(angle), math.sin(angle)
            for i in range(3):
                y, z = T[body, i, 1], T[body, i, 2]
                T[body, i, 1] = y * c + z * s
                T[body, i, 2] = z * c - y * s
                axes[hinge, i] = T[body, i, 0]
                origins[hinge, i] = T[body, i, 3]
                if k < 2:
                    T[body + 1, i, 0] = T[body, i, 0]
                    T[body + 1, i, 1] = T[body, i, 1]
                    T[body + 1, i, 2] = T[body, i, 2]
                    T[body + 1, i, 3] = T[body, i, 3] + T[body, i, 1] * lengths[finger, k]


@numba.njit(cache=True, nogil=True)
def retract(pose: Array, tangent: Array, out: Array) -> None:
    """Write the pose reached from `pose` (27,) by a tangent step (26,) to `out` (27,); see `pose.retract`."""
    retract_unnormalised(pose, tangent, out)
    out[3], out[4], out[5], out[6] = compiled_normalised(out[3], out[4], out[5], out[6])


@numba.njit(cache=True, nogil=True)
def retract_unnormalised(pose: Array, tangent: Array, out: Array) -> None:
    """Write the retraction to `out` (27,), its quaternion unit only to rounding, and of either sign.

    That is enough for a single step, as forward kinematics accepts a quaternion of any length.
    """
    for i in range(3):
        out[i] = pose[i] + tangent[i]
    w, x, y, z = compiled_exp(tangent[3], tangent[4], tangent[5])
    out[3], out[4], out[5], out[6] = compiled_product(w, x, y, z, pose[3], pose[4], pose[5], pose[6])
    for i in range(20):
        out[7 + i] = pose[7 + i] + tangent[6 + i]
