"""Forward kinematics of joints, endpoints and keypoints, and the Jacobian of any point.

Bodies: 0 is the palm; 1 + 3 f + k is phalanx k (from the palm outward) of finger f. Each phalanx has its origin at
its own joint, y along the bone, z towards the pad; flexion turns about +x, abduction about z, positive towards the
thumb (and, for the thumb itself, out of the palm: palmar abduction).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from depthtrack.geometry.rotations import rotation_matrix
from depthtrack.hand.compiled_kinematics import BODY_COUNT, Chain, transforms_of
from depthtrack.hand.pose import FINGERS, ORIENTATION, POSE_SIZE, POSITION, TANGENT_SIZE
from depthtrack.hand.shape import HandShape
from depthtrack.types import Array, Mask

JOINT_NAMES = ("wrist", *(f"{finger}_{k}" for finger in FINGERS for k in range(3)))
_THUMB_POINTS = ("cmc", "mcp", "ip", "tip")
_FINGER_POINTS = ("mcp", "pip", "dip", "tip")
ENDPOINT_NAMES = tuple(
    f"{finger}_{point}" for finger in FINGERS for point in (_THUMB_POINTS if finger == "thumb" else _FINGER_POINTS)
)
KEYPOINT_NAMES = ("wrist", *ENDPOINT_NAMES)
"""The 21 keypoints in MediaPipe's order: wrist, then thumb to little finger, base to tip."""


def body_of(finger: int, phalanx: int) -> int:
    """Return the index of a phalanx among the 16 bodies."""
    return 1 + 3 * finger + phalanx


KEYPOINT_BODIES = np.array(
    [0, *(body_of(finger, phalanx) for finger in range(5) for phalanx in (0, 0, 1, 2))], dtype=np.int64
)
"""(21,) body that each keypoint is fixed to. A joint belongs to the bone before it, which alone moves it."""


def _moves() -> Mask:
    """Return (16, 20) whether an angle moves a body."""
    moves = np.zeros((BODY_COUNT, 20), dtype=np.bool_)
    for finger in range(5):
        for phalanx in range(3):
            moves[body_of(finger, phalanx), 4 * finger : 4 * finger + 2 + phalanx] = True
    return moves


MOVES = _moves()


@dataclass(frozen=True)
class HandModel:
    """Kinematics of a hand. All methods broadcast over leading axes of the pose (..., 27)."""

    shape: HandShape

    def transforms(self, pose: ArrayLike) -> Array:
        """Return T_camera_body (..., 16, 4, 4), metres, of poses (..., 27).

        Source: Schroeder et al. 2014, Eq. (1).
        """
        p = np.asarray(pose, dtype=np.float64)
        flat = np.ascontiguousarray(p.reshape(-1, POSE_SIZE))
        T = np.empty((len(flat), BODY_COUNT, 4, 4))
        transforms_of(self.chain, flat, T)
        return T.reshape(*p.shape[:-1], BODY_COUNT, 4, 4)

    @cached_property
    def chain(self) -> Chain:
        """The constants of the hand for compiled kinematics."""
        return Chain.of(self.shape)

    @cached_property
    def reach(self) -> float:
        """Largest distance from the palm's centre to a fingertip, metres."""
        return self.shape.reach

    @property
    def lengths(self) -> Array:
        """The phalanx lengths (5, 3), metres, scaled."""
        return self.chain.lengths

    @property
    def base_transforms(self) -> Array:
        """T_palm_base (5, 4, 4), metres: the base joints with all angles zero."""
        T = np.tile(np.eye(4), (5, 1, 1))
        T[:, :3] = self.chain.base
        return T

    def wrist(self, pose: ArrayLike) -> Array:
        """Return the wrist (..., 3), metres, camera frame, of poses (..., 27)."""
        p = np.asarray(pose, dtype=np.float64)
        return np.asarray(rotation_matrix(p[..., ORIENTATION]) @ self.shape.wrist + p[..., POSITION])

    def joints(self, pose: ArrayLike) -> Array:
        """Return the joints (..., 16, 3), metres, camera frame: wrist, then phalanx origins."""
        joints = self.transforms(pose)[..., :3, 3].copy()
        joints[..., 0, :] = self.wrist(pose)
        return joints

    def endpoints(self, pose: ArrayLike) -> Array:
        """Return the phalanx endpoints (..., 20, 3), metres, camera frame, four a finger."""
        return self.endpoints_of(self.transforms(pose))

    def keypoints(self, pose: ArrayLike) -> Array:
        """Return the keypoints (..., 21, 3), metres, camera frame, in MediaPipe's order."""
        return np.concatenate([self.wrist(pose)[..., None, :], self.endpoints(pose)], axis=-2)

    def transform_points(self, pose: ArrayLike, bodies: ArrayLike, local_points: ArrayLike) -> Array:
        """Return the camera-frame positions (..., N, 3), metres, of points fixed to bodies.

        bodies: (N,) 0 to 15.
        local_points: (N, 3) metres, frames of the bodies.
        """
        T = self.transforms(pose)[..., np.asarray(bodies), :, :]
        return np.einsum("...nij,nj->...ni", T[..., :3, :3], np.asarray(local_points)) + T[..., :3, 3]

    def point_jacobian(self, pose: ArrayLike, bodies: ArrayLike, points: ArrayLike) -> Array:
        """Return the Jacobian (..., N, 3, 26) of points fixed to bodies.

        bodies: (N,) 0 to 15.
        points: (..., N, 3) metres, camera frame.

        Columns follow the tangent space of `pose.retract`. A revolute joint moves a point by the cross product of
        its axis and the lever arm (Schroeder et al. 2014, Eq. 5).
        """
        p, bodies = np.asarray(pose, dtype=np.float64), np.asarray(bodies)
        T = self.transforms(p)
        points = np.broadcast_to(np.asarray(points, dtype=np.float64), (*p.shape[:-1], len(bodies), 3))
        J = np.zeros((*points.shape, TANGENT_SIZE))
        J[..., :, :3] = np.eye(3)
        lever = points - p[..., None, POSITION]
        J[..., :, 3:6] = np.swapaxes(_cross_matrix(lever), -1, -2)
        axes, origins = self._axes(T)
        arms = points[..., :, None, :] - origins[..., None, :, :]
        turned = np.where(MOVES[bodies][..., None], np.cross(axes[..., None, :, :], arms), 0.0)
        J[..., 6:] = np.swapaxes(turned, -1, -2)
        return J

    def _axes(self, T: Array) -> tuple[Array, Array]:
        """Return the rotation axes and origins (..., 20, 3) of the angles, camera frame."""
        axes = np.empty((*T.shape[:-3], 20, 3))
        origins = np.empty_like(axes)
        abduction = self.base_transforms[:, :3, 2] * -self.shape.mirror
        for finger in range(5):
            first = T[..., body_of(finger, 0), :, :]
            axes[..., 4 * finger, :] = np.einsum("...ij,j->...i", T[..., 0, :3, :3], abduction[finger])
            origins[..., 4 * finger, :] = first[..., :3, 3]
            for phalanx in range(3):
                body = T[..., body_of(finger, phalanx), :, :]
                axes[..., 4 * finger + 1 + phalanx, :] = body[..., :3, 0]
                origins[..., 4 * finger + 1 + phalanx, :] = body[..., :3, 3]
        return axes, origins

    def endpoints_of(self, T: Array) -> Array:
        """Return the phalanx endpoints (..., 20, 3), metres, of bodies T (..., 16, 4, 4)."""
        points = np.empty((*T.shape[:-3], 20, 3))
        for finger in range(5):
            for phalanx in range(3):
                points[..., 4 * finger + phalanx, :] = T[..., body_of(finger, phalanx), :3, 3]
            last = T[..., body_of(finger, 2), :, :]
            points[..., 4 * finger + 3, :] = last[..., :3, 3] + last[..., :3, 1] * self.lengths[finger, 2]
        return points


def _cross_matrix(v: Array) -> Array:
    """Return the matrices [v]x (..., 3, 3) with [v]x u = v x u."""
    x, y, z = np.moveaxis(v, -1, 0)
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
