"""The poses of a capture whose labels are known.

Maycock et al. 2015, Eq. (4) to (6), without the assignment.
"""

from dataclasses import replace

import numpy as np

from depthtrack.hand.compiled_kinematics import Chain
from depthtrack.hand.pose import ANGLES, POSE_SIZE, make_pose
from depthtrack.hand.postures import POSTURES
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.markers.labelling.capture_fit import fit_capture
from depthtrack.markers.labelling.options import LabellingOptions
from depthtrack.markers.labelling.packed import PackedPoints
from depthtrack.markers.labelling.scene import Scene
from depthtrack.markers.labelling.state import Settings
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.solver.point_fit import aligned_poses, fit_points_each
from depthtrack.types import Array, Index

_FEWEST = 3
"""Markers that determine the position and orientation of a rigid body."""
_STARTS = ("relaxed", "open", "grasp", "fist")
"""Postures that each frame is fitted from; the best fit is kept."""
_FINGER_WEIGHT = 0.1
"""Weight of the markers of the fingers in the alignment of a start, against 1 of those of the palm."""
_LEAST_SPREAD = 0.001
"""Smallest standard deviation of a marker that its weight is computed from, metres."""


def fit_poses(labelled: LabelledCapture, options: LabellingOptions | None = None) -> LabelledCapture:
    """Return the capture with the poses that fit its labels.

    Angles of joints without a marker are interpolated. With fewer than three markers in a frame, the pose of a model is
    interpolated between other frames, or absent.
    """
    options = options or LabellingOptions()
    starts = [frame_poses(model, labelled.positions(k)) for k, model in enumerate(labelled.models)]
    points = PackedPoints.of(labelled.capture)
    number = _numbers(labelled, points)
    numbers = np.concatenate([_chosen(number, columns) for columns in labelled.columns], axis=1)
    settings = Settings.of(options, labelled.capture.rate)
    fitted = fit_capture(
        points.position,
        numbers,
        Scene.of(labelled.models),
        settings,
        np.stack([_bridged(poses) for poses in starts], axis=1),
    )
    return replace(labelled, poses=tuple(np.moveaxis(fitted.poses, 1, 0).copy()))


def frame_poses(model: MarkerModel, positions: Array) -> Array:
    """Return the pose (T, 27) of each frame alone; NaN with fewer than three markers.

    positions: (T, M, 3) metres, NaN if not measured.
    """
    seen = np.asarray(np.isfinite(positions).all(axis=-1))
    known = np.flatnonzero(seen.sum(axis=1) >= _FEWEST)
    targets = np.where(seen[known][..., None], positions[known], 0.0)
    weights = seen[known] / np.maximum(model.spread, _LEAST_SPREAD) ** 2
    rigid = np.where(seen[known], np.where(model.bodies == 0, 1.0, _FINGER_WEIGHT), 0.0)
    best, least = np.full((len(known), POSE_SIZE), np.nan), np.full(len(known), np.inf)
    for name in _STARTS:
        angles = np.zeros(POSE_SIZE)[ANGLES] if model.is_rigid else POSTURES[name]
        rest = model.positions(make_pose(np.zeros(3), [1.0, 0, 0, 0], angles))
        poses, energies = aligned_poses(angles, rest, targets, rigid), np.zeros(len(known))
        if not model.is_rigid:
            chain = Chain.of(model.kinematics.shape)
            poses, energies = fit_points_each(chain, model.bodies, model.offsets, targets, weights, poses)
        better = energies < least
        best[better], least[better] = poses[better], energies[better]
    out = np.full((len(positions), POSE_SIZE), np.nan)
    out[known] = best
    return out


def _bridged(poses: Array) -> Array:
    """Return poses (T, 27) with the one before in the frames between known ones that have none."""
    known = np.flatnonzero(np.isfinite(poses).all(axis=1))
    if len(known) == 0:
        return poses
    out, inner = poses.copy(), np.arange(known[0], known[-1] + 1)
    out[inner] = poses[known[np.searchsorted(known, inner, side="right") - 1]]
    return out


def _numbers(labelled: LabelledCapture, points: PackedPoints) -> Index:
    """Return the number (T, C) of the point of each trajectory; -1 where it was not measured."""
    number = np.full(labelled.capture.positions.shape[:2], -1, dtype=np.int64)
    number[points.frame, points.column] = np.arange(len(points.frame))
    return number


def _chosen(number: Index, columns: Index) -> Index:
    """Return the numbers (T, M) of the points in some columns (T, M), -1 where there is none."""
    return np.where(columns >= 0, np.take_along_axis(number, np.maximum(columns, 0), axis=1), -1)
