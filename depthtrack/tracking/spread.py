"""Spread of the keypoints: how far each of them may be from the truth.

A point of a bone is measured if its own flesh is what the camera sees, at the depth of the posed hand. The pose has a
normal distribution. Its precision is the sum of J^T J / s^2 over the measured points, plus that of a prior from
synergies. The sum is the matrix of Gauss-Newton (Schroeder et al. 2014, Eq. 4). Hidden fingers therefore spread like
common postures that share their visible parts. The standard deviation s is the uncertainty of the hand's sizes.
"""

from typing import NamedTuple

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.hand.compiled_kinematics import BodyPoses, endpoints
from depthtrack.hand.kinematics import KEYPOINT_BODIES, HandModel, body_of
from depthtrack.hand.shape import CALIBRATED, HandShape
from depthtrack.rendering.target import Target
from depthtrack.rendering.visibility import FLESH, points_in_view
from depthtrack.solver.point_spread import point_spread
from depthtrack.solver.prior import prior_energy
from depthtrack.tracking.posture_prior import posture_prior
from depthtrack.types import Array, Depth, Mask

LEAST = 0.0004
"""Metres: standard deviation of a measured point of a true hand, chosen on `synth random`, seeds 200 to 203."""
AGREES = 0.01
"""Metres: largest difference of rendered and observed depth at a measured point."""
OWN_FLESH = 0.003
"""Metres: depth below the rendered surface, beyond the radius of its bone, of a point that other parts hide."""
CLIPPED = 0.04
"""Metres: depth difference at which a pixel disagrees completely, d_M of Oikonomidis et al. 2011, Eq. (2)."""
_BODIES = np.repeat([body_of(finger, bone) for finger in range(5) for bone in range(3)], 2)
_PALM = np.array([0, 1, 5, 9, 13, 17])
"""Keypoints that no finger moves: the wrist and the bases of the fingers."""


class BonesInView(NamedTuple):
    """The bones of a posed hand, at the far end and the middle of each, beside the observation.

    visible: (5, 3, 2) whether no other part of the hand and no occluder hides the point.
    differences: (5, 3, 2) of rendered and observed depth around it, clipped, metres.
    spread: (21,) root mean square distance of the keypoints from the truth, metres. A normal distribution has about
        68 % of its points closer than that, in one dimension or three.
    widest: largest spread of a keypoint if the hand were a calibrated one. The confidence depends on it.
    posture: distance of the finger angles from common postures, in standard deviations.
    """

    visible: Mask
    differences: Array
    spread: Array
    widest: float
    posture: float

    @property
    def finger_visibility(self) -> Array:
        """Visible share (5,) of each finger."""
        return np.asarray(self.visible.mean(axis=(1, 2)))


def bones_in_view(model: HandModel, pose: Array, rendered: Depth, target: Target) -> BonesInView:
    """Return what the camera sees of the bones in a pose (27,).

    rendered: (h, w) depth of the posed hand, metres; 0 for none.
    """
    bodies, ends, points = BodyPoses.at(model.chain, pose), np.empty((5, 4, 3)), np.empty((5, 3, 2, 3))
    endpoints(model.chain, bodies, ends)
    points[:, :, 0], points[:, :, 1] = ends[:, 1:], (ends[:, 1:] + ends[:, :-1]) / 2
    visible, own = np.empty((5, 3, 2), np.bool_), np.empty((5, 3, 2), np.bool_)
    differences, camera = np.empty((5, 3, 2)), target.camera
    compare_points(
        points.reshape(-1, 3),
        (bone_radii(model.shape) + OWN_FLESH).reshape(-1),
        (camera.fx, camera.fy, camera.cx, camera.cy),
        (rendered, target.depth, target.silhouette),
        visible.reshape(-1),
        own.reshape(-1),
        differences.reshape(-1),
    )
    if target.hiding is not None:
        # Bones lie inside the fingers: none is behind what does not hide its finger.
        visible &= points_in_view(points, target.hiding, target.camera, behind=0.0)
    measured = visible & own & (differences < AGREES)
    posture, uncertainty = float(np.sqrt(2 * prior_energy(pose, posture_prior()))), model.shape.uncertainty
    deviations = (CALIBRATED,) if uncertainty == CALIBRATED else (CALIBRATED, max(LEAST, uncertainty))
    usual, *others = keypoint_spreads(model, bodies, ends, points, measured, deviations)
    spread = others[0] if others else usual
    return BonesInView(visible, differences, spread, float(usual.max()), posture)


def bone_radii(shape: HandShape) -> Array:
    """Return the radii (5, 3, 2) of bones at their far end and middle, metres."""
    radii = shape.scale * shape.radii
    return np.stack([radii[:, 1:], (radii[:, 1:] + radii[:, :-1]) / 2], axis=2)


def keypoint_spreads(
    model: HandModel,
    bodies: BodyPoses,
    ends: Array,
    points: Array,
    measured: Mask,
    uncertainties: tuple[float, ...],
) -> list[Array]:
    """Return the root mean square distances (21,) of the keypoints from the truth, metres.

    ends: (5, 4, 3) endpoints of the phalanges, metres, camera frame.
    points: (5, 3, 2, 3) far end and middle of each bone, metres, camera frame.
    measured: (5, 3, 2) which of them are measured; the palm always is.
    uncertainties: standard deviations of a measured point, metres; each gives one array.
    """
    palm, keypoints = bodies.T[0], np.empty((21, 3))
    keypoints[0], keypoints[1:] = palm[:, :3] @ model.shape.wrist + palm[:, 3], ends.reshape(20, 3)
    seen = measured.reshape(-1)
    at = np.concatenate([points.reshape(-1, 3)[seen], keypoints[_PALM]])
    fixed_to = np.append(_BODIES[seen], KEYPOINT_BODIES[_PALM])
    measurements, precision = (fixed_to, at, KEYPOINT_BODIES, keypoints), posture_prior().precision
    return [point_spread(bodies, precision, each, *measurements) for each in uncertainties]


@compiled(nogil=True)
def compare_points(
    points: Array,
    flesh: Array,
    lens: tuple[float, float, float, float],
    images: tuple[Depth, Depth, Mask],
    visible: Mask,
    own: Mask,
    differences: Array,
) -> None:
    """Compare the depth around the points of bones.

    The differences are means over 3 x 3 pixels. A rendered pixel outside the observed silhouette disagrees completely.
    One without a reading inside does not count. Where no pixel counts, nothing is compared, and the difference is
    complete as well.

    points: (N, 3) metres, camera frame.
    flesh: (N,) depth below the rendered surface of a point whose own flesh is seen, metres.
    lens: fx, fy, cx, cy, pixels.
    images: rendered and observed depth, metres, and observed silhouette (h, w).
    visible, own: (N,) output: whether nothing is before the point, and whether its own flesh is what is seen.
    differences: (N,) output: of rendered and observed depth, metres, at most `CLIPPED`.
    """
    (fx, fy, cx, cy), (rendered, depth, silhouette) = lens, images
    height, width = rendered.shape
    for n in range(points.shape[0]):
        x, y, z = points[n, 0], points[n, 1], points[n, 2]
        visible[n], own[n], differences[n] = False, False, CLIPPED
        if not z > 0.0:
            continue
        across, down = np.rint(fx * x / z + cx), np.rint(fy * y / z + cy)
        if not (-2 < across < width + 1 and -2 < down < height + 1):
            continue
        u, v = int(across), int(down)
        if 0 <= u < width and 0 <= v < height:
            front = np.float64(rendered[v, u])
            visible[n] = front == 0.0 or z - front < FLESH
            own[n] = front == 0.0 or z - front < flesh[n]
        count, total = 0, 0.0
        for j in range(max(v - 1, 0), min(v + 2, height)):
            for i in range(max(u - 1, 0), min(u + 2, width)):
                here, there = np.float64(rendered[j, i]), np.float64(depth[j, i])
                if here == 0.0 or (silhouette[j, i] and there == 0.0):
                    continue
                count += 1
                total += min(abs(here - there), CLIPPED) if silhouette[j, i] else CLIPPED
        if count > 0:
            differences[n] = total / count
