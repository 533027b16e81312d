"""Gap filling by smoothing the joints over the whole gap, with what the other markers show."""

import numpy as np

from depthtrack.markers.filled_capture import Filling, Gap, runs
from depthtrack.markers.filling.bridging import bridged
from depthtrack.markers.filling.correction import marker_offsets, whole_chains
from depthtrack.markers.filling.joints import determined
from depthtrack.markers.filling.motion_prior import MotionPrior, learn_motion_prior
from depthtrack.markers.filling.options import SmoothFillOptions
from depthtrack.markers.filling.prediction import Prediction
from depthtrack.markers.filling.smoothing import Smoothed, Stretch, posterior_samples, smooth
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.types import Array, Mask

_DRAWS = 48
"""Draws of the posterior; their root mean square is within 6 % of its standard deviation."""


def smooth_fill(
    model: MarkerModel, measured: Array, poses: Array, gaps: list[Gap], rate: float, options: SmoothFillOptions
) -> Prediction:
    """Return the markers of a model in its gaps.

    measured: (T, M, 3) metres, capture frame; NaN if not measured.
    poses: (T, 27) capture frame.
    gaps: of this model.
    rate: frames a second, Hz.

    First every marker gets its place on the body, as the frames about a gap show it: the model then meets the
    measured markers at both ends. The poses of the gap are smoothed, and the places corrected by what remains.
    """
    visible = np.isfinite(measured).all(axis=-1)
    known = determined(model, visible)
    prior = learn_motion_prior(poses, known, rate, options)
    start = bridged(poses, known)
    width = max(round(options.correction_time * rate), 1)
    whole = whole_chains(model, visible) & np.isfinite(poses).all(axis=1)[:, None]
    places = marker_offsets(model, poses, measured, whole, width)
    shape = visible.shape
    result = Prediction(np.full((*shape, 3), np.nan), np.zeros(shape, np.int64), np.full(shape, np.nan), poses.copy())
    for first, last in _stretches(gaps, len(poses), round(options.border * rate)):
        rows = slice(first, last)
        stretch = _stretch(model, measured[rows], visible[rows], places[rows], prior, options)
        smoothed = smooth(stretch, start[rows], options.iterations)
        offsets = marker_offsets(model, smoothed.poses, measured[rows], visible[rows], width)
        unseen = ~visible[rows].any(axis=0)
        offsets[:, unseen] = places[rows][:, unseen]
        result.positions[rows] = _positions(model, smoothed.poses, offsets)
        result.expected_error[rows] = _spread(model, smoothed, offsets, visible[rows], stretch.size)
        empty = ~visible[rows].all(axis=1)
        result.poses[rows] = np.where(empty[:, None], smoothed.poses, result.poses[rows])
    result.how[:] = np.where(np.isfinite(result.positions).all(axis=-1), Filling.SMOOTHED, Filling.GAP)
    return result


def _stretches(gaps: list[Gap], frames: int, border: int) -> list[tuple[int, int]]:
    """Return first and one past the last frame of the stretches to smooth; those that overlap are one."""
    covered = np.zeros(frames, dtype=np.bool_)
    for gap in gaps:
        covered[max(gap.start - max(border, 2), 0) : gap.stop + max(border, 2)] = True
    return [(first, last) for first, last in runs(covered) if last - first >= 3]


def _stretch(
    model: MarkerModel, measured: Array, visible: Mask, places: Array, prior: MotionPrior, options: SmoothFillOptions
) -> Stretch:
    targets = np.where(visible[..., None], measured, 0.0)
    weights = visible / options.marker_noise**2
    size = 6 if model.is_rigid else 26
    return Stretch(model.kinematics.chain, model.bodies, places, targets, weights, prior, size)


def _positions(model: MarkerModel, poses: Array, offsets: Array) -> Array:
    """Return the markers (T, M, 3) at offsets (T, M, 3) in the frames of their bodies."""
    T = model.kinematics.transforms(poses)[:, model.bodies]
    return np.asarray(np.einsum("tmij,tmj->tmi", T[..., :3, :3], offsets) + T[..., :3, 3])


def _spread(model: MarkerModel, smoothed: Smoothed, offsets: Array, visible: Mask, size: int) -> Array:
    """Return the root mean square distance (T, M) of the markers of the posterior from the mean, metres."""
    tangents = posterior_samples(smoothed, _DRAWS, size)
    squared = np.zeros(visible.shape)
    points = _positions(model, smoothed.poses, offsets)
    for frame in np.flatnonzero(~visible.all(axis=1)):
        J = model.kinematics.point_jacobian(smoothed.poses[frame], model.bodies, points[frame])
        moved = np.einsum("mij,sj->smi", J, tangents[:, frame])
        squared[frame] = np.mean(np.sum(moved**2, axis=-1), axis=0)
    return np.asarray(np.sqrt(squared))
