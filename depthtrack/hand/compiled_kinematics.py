"""Compiled forward kinematics of the hand, one pose at a time.

`HandModel` wraps them for batches. The tests compare them with `reference_kinematics`.
"""

import math
from typing import NamedTuple

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.geometry.rotations import compiled_matrix
from depthtrack.hand.shape import HandShape
from depthtrack.types import Array

BODY_COUNT = 16
"""The palm and three phalanges a finger."""


class Chain(NamedTuple):
    """The kinematic constants of a hand.

    base: (5, 3, 4) T_palm_base with all angles zero, metres.
    lengths: (5, 3) of the phalanges, metres, scaled.
    mirror: +1 for a right hand, -1 for a left one.
    """

    base: Array
    lengths: Array
    mirror: float

    @staticmethod
    def of(shape: HandShape) -> "Chain":
        """Return the chain of a hand of these sizes."""
        base = np.tile(np.eye(4), (5, 1, 1))
        base[:, :3, 3] = shape.bases * shape.scale
        y = shape.thumb_direction / np.linalg.norm(shape.thumb_direction)
        z = shape.thumb_pad - y * (shape.thumb_pad @ y)
        z = z / np.linalg.norm(z)
        base[0, :3, :3] = np.stack([np.cross(y, z), y, z], axis=-1)
        flip = np.diag([shape.mirror, 1, 1, 1])
        base = flip @ base @ flip
        return Chain(np.ascontiguousarray(base[:, :3]), shape.lengths * shape.scale, shape.mirror)


class BodyPoses(NamedTuple):
    """A posed hand in the camera frame, metres.

    T: (16, 3, 4) T_camera_body.
    axes: (20, 3) unit axis of each finger angle.
    origins: (20, 3) a point on each axis.
    """

    T: Array
    axes: Array
    origins: Array

    @staticmethod
    def empty() -> "BodyPoses":
        """Return zeroed arrays for `forward_kinematics`."""
        return BodyPoses(np.zeros((BODY_COUNT, 3, 4)), np.zeros((20, 3)), np.zeros((20, 3)))

    @staticmethod
    def at(chain: Chain, pose: Array) -> "BodyPoses":
        """Return the hand in a pose (27,)."""
        bodies = BodyPoses.empty()
        forward_kinematics(chain, np.ascontiguousarray(pose, dtype=np.float64), bodies)
        return bodies


@compiled(nogil=True)
def forward_kinematics(chain: Chain, pose: Array, bodies: BodyPoses) -> None:
    """Write the bodies in a pose (27,) to `bodies`: Eq. (1) of Schroeder et al. 2014.

    The quaternion may have any length except zero.
    """
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


@compiled(nogil=True)
def transforms_of(chain: Chain, poses: Array, out: Array) -> None:
    """Write T_camera_body (N, 16, 4, 4), metres, of poses (N, 27) to `out`."""
    bodies = BodyPoses(np.empty((BODY_COUNT, 3, 4)), np.empty((20, 3)), np.empty((20, 3)))
    for n in range(poses.shape[0]):
        forward_kinematics(chain, poses[n], bodies)
        for b in range(BODY_COUNT):
            for j in range(4):
                for i in range(3):
                    out[n, b, i, j] = bodies.T[b, i, j]
                out[n, b, 3, j] = 1.0 if j == 3 else 0.0


@compiled(nogil=True)
def point_jacobian(bodies: BodyPoses, b: int, x: Array, out: Array) -> None:
    """Write the Jacobian (3, 26) of a point fixed to body b; see `HandModel.point_jacobian`.

    x: (3,) the point, metres, camera frame.
    """
    for i in range(3):
        for j in range(26):
            out[i, j] = 1.0 if i == j else 0.0
    px, py, pz = x[0] - bodies.T[0, 0, 3], x[1] - bodies.T[0, 1, 3], x[2] - bodies.T[0, 2, 3]
    out[0, 4], out[0, 5] = pz, -py
    out[1, 3], out[1, 5] = -pz, px
    out[2, 3], out[2, 4] = py, -px
    if b == 0:
        return
    finger, phalanx = (b - 1) // 3, (b - 1) % 3
    for a in range(4 * finger, 4 * finger + 2 + phalanx):
        u, o = bodies.axes[a], bodies.origins[a]
        rx, ry, rz = x[0] - o[0], x[1] - o[1], x[2] - o[2]
        out[0, 6 + a] = u[1] * rz - u[2] * ry
        out[1, 6 + a] = u[2] * rx - u[0] * rz
        out[2, 6 + a] = u[0] * ry - u[1] * rx


@compiled(nogil=True)
def endpoints(chain: Chain, bodies: BodyPoses, out: Array) -> None:
    """Write the phalanx endpoints (5, 4, 3), metres, camera frame; see `HandModel.endpoints`."""
    for finger in range(5):
        for phalanx in range(3):
            for i in range(3):
                out[finger, phalanx, i] = bodies.T[1 + 3 * finger + phalanx, i, 3]
        last = bodies.T[3 + 3 * finger]
        for i in range(3):
            out[finger, 3, i] = last[i, 3] + last[i, 1] * chain.lengths[finger, 2]
