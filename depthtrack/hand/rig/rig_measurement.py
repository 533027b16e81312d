"""Measurement of a `HandShape` and of bone frames on a mesh with known finger joints.

All arrays are a right hand's, in its palm frame, in metres.

`points` (5, 4, 3): three joints and the tip of each finger.
`vertices` (V, 3), `weights` (V, 16): the skin and its bodies.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from depthtrack.hand.kinematics import HandModel, body_of
from depthtrack.hand.pose import make_pose
from depthtrack.hand.shape import HandShape
from depthtrack.types import Array

_BENT = 0.25
"""Least bend of the thumb in the mesh (sum of two sines) that gives its plane of flexion."""


def measured_shape(points: Array, vertices: Array, weights: Array, source: str) -> HandShape:
    """Return the sizes of the hand: lengths and bases from joints, radii and palm from the skin.

    The thumb's direction in the mesh becomes its resting one. Sizes that the mesh does not give are the average
    hand's, in proportion.
    """
    default = HandShape()
    bones = np.diff(points, axis=1)
    lengths = np.linalg.norm(bones, axis=-1)
    radii = np.stack([_radii(points[f], bones[f], vertices, weights, f, default) for f in range(5)])
    bases = points[:, 0]
    palm_length = 2 * float(bases[2, 1])  # the wrist lies as far below the centre as the middle knuckle above
    thumb = bones[0] / lengths[0, :, None]
    palm = vertices[weights.argmax(axis=-1) == 0]
    middle = _slice(palm, 0.0, 0.15 * palm_length)
    between = np.quantile(bases[1:, 0], [0.25, 0.75])
    wrist = _slice(palm, -palm_length / 2, 0.1 * palm_length)
    ratio = palm_length / default.palm_length
    return HandShape(
        lengths=lengths,
        radii=radii,
        bases=bases,
        thumb_direction=thumb[0],
        thumb_pad=_thumb_pad(thumb, default),
        palm_breadth=float(bases[1, 0] + radii[1, 0] - bases[4, 0] + radii[4, 0]),
        palm_length=palm_length,
        palm_thickness=_extent(
            middle[(middle[:, 0] > between[0]) & (middle[:, 0] < between[1]), 2], default.palm_thickness * ratio
        ),
        wrist_breadth=_extent(wrist[:, 0], default.wrist_breadth * ratio),
        wrist_thickness=_extent(wrist[:, 2], default.wrist_thickness * ratio),
        source=source,
    )


def bone_frames(shape: HandShape, points: Array) -> Array:
    """Return T_palm_body (16, 4, 4) at rest: origin at joints, y along bones, z to the pads.

    The rotation about the bone is that of `HandModel` at the joint angles closest to the mesh.
    """
    directions = np.diff(points, axis=1) / shape.lengths[..., None]
    model = HandModel(shape)
    angles = np.zeros((5, 4))
    for finger in range(5):
        R = model.base_transforms[finger, :3, :3]
        x, y, z = R.T @ directions[finger, 0]
        angles[finger, :2] = np.arctan2(x, y), np.arctan2(z, np.hypot(x, y))
        R = R @ Rotation.from_euler("ZX", [-angles[finger, 0], angles[finger, 1]]).as_matrix()
        for k in (1, 2):
            _, y, z = R.T @ directions[finger, k]
            angles[finger, 1 + k] = np.arctan2(z, y)
            R = R @ Rotation.from_euler("X", angles[finger, 1 + k]).as_matrix()
    T = model.transforms(make_pose(np.zeros(3), (1, 0, 0, 0), angles.ravel()))
    for finger in range(5):
        for k in range(3):
            body, y = body_of(finger, k), directions[finger, k]
            x = np.cross(y, T[body, :3, 2])
            x /= np.linalg.norm(x)
            T[body, :3, :3] = np.stack([x, y, np.cross(x, y)], axis=-1)
            T[body, :3, 3] = points[finger, k]
    return T


def _radii(points: Array, bones: Array, vertices: Array, weights: Array, finger: int, default: HandShape) -> Array:
    """Return radii (4,) at base, two joints and tip: median distances of the skin from the bone."""
    lengths = np.linalg.norm(bones, axis=-1)
    along = bones / lengths[:, None]
    own = [weights[:, body_of(finger, k)] for k in range(3)]
    fallback = default.radii[finger] * lengths.sum() / default.lengths[finger].sum()
    radii = fallback.copy()
    for k in (1, 2):
        axis = (along[k - 1] + along[k]) / np.linalg.norm(along[k - 1] + along[k])
        near = vertices[own[k - 1] + own[k] >= 0.5]
        radii[k] = _thickness(near - points[k], axis, -0.2 * lengths[k], 0.2 * lengths[k], fallback[k])
    # The tip's ball; and the base, which the palm hides: extrapolated from the free part of the first phalanx.
    tip = vertices[own[2] >= 0.5] - points[2]
    radii[3] = _thickness(tip, along[2], 0.45 * lengths[2], 0.8 * lengths[2], fallback[3])
    radii[3] = min(radii[3], radii[2], 0.6 * lengths[2])
    if finger == 0:
        radii[0] = radii[1] * default.radii[0, 0] / default.radii[0, 1]
    else:
        free = vertices[own[0] >= 0.5] - points[0]
        t = 0.6
        there = _thickness(free, along[0], 0.5 * lengths[0], 0.7 * lengths[0], fallback[0])
        radii[0] = np.clip((there - t * radii[1]) / (1 - t), radii[1], 1.4 * radii[1])
    return radii


def _thickness(points: Array, axis: Array, low: float, high: float, fallback: float) -> float:
    """Return the median distance of points (N, 3) from an axis, between two heights on it."""
    height = points @ axis
    around = points[(height > low) & (height < high)]
    if len(around) < 4:
        return fallback
    return float(np.median(np.linalg.norm(around - (around @ axis)[:, None] * axis, axis=-1)))


def _thumb_pad(thumb: Array, default: HandShape) -> Array:
    """Return the direction (3,) of the thumb's pad: of its bend, or the average if straight."""
    bend = (thumb[1] + thumb[2]) - (thumb[1] + thumb[2]) @ thumb[0] * thumb[0]
    if np.linalg.norm(bend) < _BENT:
        return default.thumb_pad
    return np.asarray(bend / np.linalg.norm(bend) * (1 if bend @ default.thumb_pad >= 0 else -1))


def _slice(vertices: Array, y: float, half: float) -> Array:
    return vertices[np.abs(vertices[:, 1] - y) < half]


def _extent(values: Array, fallback: float) -> float:
    return float(np.ptp(values)) if len(values) >= 8 else fallback
