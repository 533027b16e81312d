"""Residuals of 2D keypoints: the distances of the hand's keypoints from lines of sight.

A keypoint of the image lies on a ray from the centre of the camera along the unit vector d. The residual of the hand's
point x is its distance from that ray, the object-space error of Lu, Hager and Mjolsness, "Fast and globally convergent
pose estimation from video images", PAMI 22(6), 2000, Eq. (17):

    e = (I - d d^T) x

With orthonormal n1, n2 across d these are the two rows n1 . x and n2 . x. To first order they are the reprojection
error in pixels times z / f, so that they add to distances in metres. They are `FixedPoints` with target zero, exact
in any pose. A third row along d holds the depth of a keypoint whose distance is measured.
"""

from dataclasses import dataclass

import numpy as np

from depthtrack.geometry.camera import Camera
from depthtrack.hand.compiled_kinematics import BodyPoses
from depthtrack.hand.kinematics import KEYPOINT_BODIES
from depthtrack.recording.sequence import ImageKeypoints
from depthtrack.solver.fixed_points import FixedPoints
from depthtrack.solver.robust import geman_mcclure
from depthtrack.types import Array, Index

COUNT = len(KEYPOINT_BODIES)
_BEFORE = 3.0
"""Scale of the kernel for points before a reading, as a multiple of that for points beyond it."""


@dataclass(frozen=True)
class LinesOfSight:
    """The rays of 21 keypoints, with the residuals of the hand's points as a block.

    The block has the rows n1, n2 and d of each keypoint, in this order. `reweigh` sets their weights in place.

    directions: (21, 3) unit, camera frame; any direction for an unknown keypoint.
    confidence: (21,) 0 to 1; 0 for an unknown keypoint.
    reach: (21,) distance of each keypoint along its ray, metres; NaN if it is not measured.
    local: (21, 3) metres, the hand's points in the frames of their bodies.
    """

    directions: Array
    confidence: Array
    reach: Array
    local: Array
    block: FixedPoints

    @staticmethod
    def of(keypoints: ImageKeypoints, camera: Camera, local: Array, reach: Array | None = None) -> "LinesOfSight":
        """Return the rays of keypoints in the image of a camera.

        local: (21, 3) metres, see `solver.keypoints.local_keypoints`.
        reach: (21,) metres, NaN if unknown; all unknown by default.
        """
        known = np.asarray(np.isfinite(keypoints.pixels).all(axis=-1))
        rays = camera.unproject(np.where(known[:, None], keypoints.pixels, 0.0), np.ones(COUNT))
        d = rays / np.linalg.norm(rays, axis=-1, keepdims=True)
        # Any vector that is not parallel to d: rays point forward.
        n1 = np.cross(d, [0.0, 1.0, 0.0])
        n1 /= np.linalg.norm(n1, axis=-1, keepdims=True)
        n2 = np.cross(d, n1)
        measured = np.full(COUNT, np.nan) if reach is None else reach
        targets = np.zeros((COUNT, 3, 3))
        targets[:, 2] = np.nan_to_num(measured)[:, None] * d
        block = FixedPoints.of(
            np.repeat(KEYPOINT_BODIES, 3),
            np.repeat(local, 3, axis=0),
            targets.reshape(-1, 3),
            np.zeros(3 * COUNT),
            np.stack([n1, n2, d], axis=1).reshape(-1, 3),
        )
        return LinesOfSight(d, np.where(known, keypoints.confidence, 0.0), measured, local, block)

    def distances(self, bodies: BodyPoses) -> tuple[Array, Array]:
        """Return the distances of the hand's points from their rays, and along them.

        Both are (21,), metres. The second is positive beyond the measured distance, and NaN without one.
        """
        T = bodies.T[KEYPOINT_BODIES]
        x = np.einsum("nij,nj->ni", T[:, :, :3], self.local) + T[:, :, 3]
        along = np.einsum("ni,ni->n", x, self.directions)
        across = x - along[:, None] * self.directions
        return np.sqrt(np.einsum("ni,ni->n", across, across)), along - self.reach

    def reweigh(self, bodies: BodyPoses, weight: float, scale: float, along_weight: float = 0.0) -> None:
        """Set the weights of iteratively reweighted least squares at the current bodies.

        weight: of a keypoint of confidence 1 on its ray.
        scale: of the Geman-McClure kernel, metres.
        along_weight: of the distance along the ray.
        """
        across, along = self.distances(bodies)
        weights = self.block.weight.reshape(COUNT, 3)
        weights[:, :2] = (weight * self.confidence * geman_mcclure(across**2, scale))[:, None]
        weights[:, 2] = along_weight * self.confidence * depth_weight(along, scale)

    def misfits(self, bodies: BodyPoses, scale: float) -> Array:
        """Return the Geman-McClure costs (21,) of the keypoints, 0 to 1; NaN for unknown ones."""
        across, _ = self.distances(bodies)
        return np.where(self.confidence > 0, across**2 / (across**2 + scale**2), np.nan)

    def agreement(self, bodies: BodyPoses, scale: float, counts: Index) -> float:
        """Return 1 minus the mean cost, weighted by confidence and by the points of the bodies.

        counts: (16,) observed points of each body.
        """
        weights = self.confidence * counts[KEYPOINT_BODIES]
        total = float(weights.sum())
        costs = np.nan_to_num(self.misfits(bodies, scale))
        return 1 - float(weights @ costs) / total if total > 0 else 0.0


def mean_misfit(misfits: Array) -> float:
    """Return the mean of the known ones among the costs of keypoints (N,); 1 without any."""
    known = misfits[np.isfinite(misfits)]
    return float(known.mean()) if len(known) else 1.0


def depth_weight(along: Array, scale: float) -> Array:
    """Return the weights of distances beyond the measured ones, metres; 0 for NaN.

    A point beyond the reading is hidden by another part, which is common. A point before the reading is an error,
    unless the reading is that of the background. The Geman-McClure kernel has a wider scale on that side.
    """
    ratio = np.nan_to_num(along, nan=np.inf) / _depth_scale(along, scale)
    return geman_mcclure(ratio**2, 1.0)


def depth_cost(along: Array, scale: float) -> Array:
    """Return the costs that `depth_weight` minimises, m^2; as much as a hidden point's for NaN."""
    square = _depth_scale(along, scale) ** 2
    return square * (1 - 1 / (1 + np.nan_to_num(along, nan=np.inf) ** 2 / square))


def _depth_scale(along: Array, scale: float) -> Array:
    return np.where(along < 0, _BEFORE * scale, scale)
