"""Spread of the keypoints: how far each of them may be from the truth.

A point of a bone is measured if its own flesh is what the camera sees, at the depth of the posed hand. The pose has a
normal distribution. Its precision is the sum of J^T J / MEASURED^2 over the measured points, plus that of a prior from
synergies. The sum is the matrix of Gauss-Newton (Schroeder et al. 2014, Eq. 4). Hidden fingers therefore spread like
common postures that share their visible parts.
"""

from typing import NamedTuple

import numpy as np

from depthtrack.hand.kinematics import KEYPOINT_BODIES, HandModel, body_of
from depthtrack.hand.pose import TANGENT_SIZE
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.target import Target
from depthtrack.rendering.visibility import points_in_view
from depthtrack.solver.prior import prior_energy
from depthtrack.tracking.posture_prior import common_postures
from depthtrack.types import Array, Depth, Mask

MEASURED = 0.004
"""Metres: standard deviation of a measured point. Source: see `tools/fit_confidence.py`."""
AGREES = 0.01
"""Metres: largest difference of rendered and observed depth at a measured point."""
OWN_FLESH = 0.003
"""Metres: depth below the rendered surface, beyond the radius of its bone, of a point that other parts hide."""
CLIPPED = 0.04
"""Metres: depth difference at which a pixel disagrees completely, d_M of Oikonomidis et al. 2011, Eq. (2)."""
_BODIES = np.repeat([body_of(finger, bone) for finger in range(5) for bone in range(3)], 2)
_PALM = np.array([0, 1, 5, 9, 13, 17])
"""Keypoints that no finger moves: the wrist and the bases of the fingers."""
_ANGLES = slice(6, TANGENT_SIZE)
_AROUND = np.stack(np.meshgrid([-1, 0, 1], [-1, 0, 1]), axis=-1).reshape(9, 2)


class BonesInView(NamedTuple):
    """The bones of a posed hand, at the far end and the middle of each, beside the observation.

    visible: (5, 3, 2) whether no other part of the hand and no occluder hides the point.
    differences: (5, 3, 2) of rendered and observed depth around it, clipped, metres.
    spread: (21,) root mean square distance of the keypoints from the truth, metres. A normal distribution has about
        68 % of its points closer than that, in one dimension or three.
    posture: distance of the finger angles from common postures, in standard deviations.
    """

    visible: Mask
    differences: Array
    spread: Array
    posture: float

    @property
    def finger_visibility(self) -> Array:
        """Visible share (5,) of each finger."""
        return np.asarray(self.visible.mean(axis=(1, 2)))


def bones_in_view(model: HandModel, pose: Array, rendered: Depth, target: Target) -> BonesInView:
    """Return what the camera sees of the bones in a pose (27,).

    rendered: (h, w) depth of the posed hand, metres; 0 for none.
    """
    ends = model.endpoints(pose).reshape(5, 4, 3)
    points = np.stack([ends[:, 1:], (ends[:, 1:] + ends[:, :-1]) / 2], axis=2)
    visible = points_in_view(points, rendered, target.camera)
    if target.occluder is not None:
        # Bones lie inside the fingers: none is behind an object that does not hide its finger.
        visible &= points_in_view(points, target.occluder, target.camera, behind=0.0)
    differences = depth_differences(points, rendered, target)
    own = visible & points_in_view(points, rendered, target.camera, bone_radii(model.shape) + OWN_FLESH)
    spread = keypoint_spread(model, pose, points, own & (differences < AGREES))
    return BonesInView(visible, differences, spread, float(np.sqrt(2 * prior_energy(pose, common_postures()))))


def bone_radii(shape: HandShape) -> Array:
    """Return the radii (5, 3, 2) of bones at their far end and middle, metres."""
    radii = shape.scale * shape.radii
    return np.stack([radii[:, 1:], (radii[:, 1:] + radii[:, :-1]) / 2], axis=2)


def depth_differences(points: Array, rendered: Depth, target: Target) -> Array:
    """Return mean differences (...) of rendered and observed depth, metres.

    They are those of 3 x 3 pixels around each of the points (..., 3).
    A rendered pixel outside the observed silhouette disagrees completely. One without a reading inside does not count.
    Where no pixel counts, nothing is compared, and the difference is complete as well.
    """
    centre = np.rint(np.nan_to_num(target.camera.project(points), nan=-9.0)).astype(np.int64)
    u, v = np.moveaxis(centre[..., None, :] + _AROUND, -1, 0)
    inside = (u >= 0) & (v >= 0) & (u < target.camera.width) & (v < target.camera.height)
    at = np.where(inside, v, 0), np.where(inside, u, 0)
    there, here, silhouette = target.depth[at], rendered[at], target.silhouette[at]
    difference = np.where(silhouette, np.minimum(np.abs(here - there), CLIPPED), CLIPPED)
    counts = inside & (here > 0) & (~silhouette | (there > 0))
    compared = counts.sum(axis=-1)
    total = np.where(counts, difference, 0.0).sum(axis=-1)
    return np.where(compared > 0, total / np.maximum(compared, 1), CLIPPED)


def keypoint_spread(model: HandModel, pose: Array, points: Array, measured: Mask) -> Array:
    """Return the root mean square distance (21,) of the keypoints from the truth, metres.

    points: (5, 3, 2, 3) far end and middle of each bone, metres, camera frame.
    measured: (5, 3, 2) which of them are measured; the palm always is.
    """
    keypoints = model.keypoints(pose)
    bodies, places = np.append(_BODIES, KEYPOINT_BODIES), np.append(points.reshape(-1, 3), keypoints, axis=0)
    bones, joints = np.split(model.point_jacobian(pose, bodies, places), [len(_BODIES)])
    J = np.concatenate([bones[measured.ravel()], joints[_PALM]]).reshape(-1, TANGENT_SIZE)
    precision = J.T @ J / MEASURED**2
    precision[_ANGLES, _ANGLES] += common_postures().precision
    return np.sqrt(np.einsum("nki,ij,nkj->n", joints, np.linalg.inv(precision), joints))
