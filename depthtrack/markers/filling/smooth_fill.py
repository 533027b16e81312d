"""Gap filling by smoothing the joints over the whole gap, with what the other markers show."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from depthtrack.markers.filled_capture import Filling, Gap, measured_samples, runs
from depthtrack.markers.filling.bridging import bridged
from depthtrack.markers.filling.correction import marker_offsets, whole_chains
from depthtrack.markers.filling.expected_error import averaged_error, regression_error, spread_error
from depthtrack.markers.filling.joints import determined
from depthtrack.markers.filling.marker_regression import regress_marker
from depthtrack.markers.filling.motion_prior import MotionPrior, learn_motion_prior
from depthtrack.markers.filling.options import SmoothFillOptions
from depthtrack.markers.filling.prediction import Prediction, time_to_measured
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
    visible = measured_samples(measured)
    known = determined(model, visible)
    prior = learn_motion_prior(poses, known, rate, options)
    start = bridged(poses, known)
    width = max(round(options.correction_time * rate), 1)
    whole = whole_chains(model, visible) & measured_samples(poses)[:, None]
    places = marker_offsets(model, poses, measured, whole, width)
    wander = _wander(places, whole, time_to_measured(visible, rate), options.wander_time)
    shape = visible.shape
    result = Prediction(np.full((*shape, 3), np.nan), np.zeros(shape, np.int64), np.full(shape, np.nan), poses.copy())
    border, piece = max(round(options.border * rate), 2), max(round(options.piece * rate), 3)
    for first, last, rows in _stretches(gaps, len(poses), border, piece) if measured_samples(start).any() else ():
        stretch = _stretch(model, measured[rows], visible[rows], places[rows], prior, options)
        smoothed = smooth(stretch, start[rows], options.iterations)
        offsets = marker_offsets(model, smoothed.poses, measured[rows], visible[rows], width)
        unseen = ~visible[rows].any(axis=0)
        offsets[:, unseen] = places[rows][:, unseen]
        spread = np.hypot(_spread(model, smoothed, offsets, visible[rows], stretch.size), wander[rows])
        kept, inside = slice(first, last), slice(first - rows.start, last - rows.start)
        result.positions[kept] = _positions(model, smoothed.poses, offsets)[inside]
        result.expected_error[kept] = spread_error(spread)[inside]
        empty = first + np.flatnonzero(~visible[kept].all(axis=1))
        result.poses[empty] = smoothed.poses[empty - rows.start]
    if options.regress and not model.is_rigid:
        _average_with_regression(model, measured, gaps, rate, options, result)
    result.how[:] = np.where(np.isfinite(result.positions).all(axis=-1), Filling.SMOOTHED, Filling.GAP)
    return result


def _average_with_regression(
    model: MarkerModel, measured: Array, gaps: list[Gap], rate: float, options: SmoothFillOptions, result: Prediction
) -> None:
    """Average the markers of gaps in `result` with those of the regression, by precision."""
    smoothed = np.where(np.isfinite(measured), measured, result.positions)
    for gap in gaps:
        regressed = regress_marker(model, measured, smoothed, gap, rate, options.regression)
        rows = slice(gap.start, gap.stop)
        error = result.expected_error[rows, gap.marker]
        if regressed is None or not np.isfinite(error).all():
            continue
        other = regression_error(regressed.error)
        share = (error**2 / (error**2 + other**2))[:, None]
        positions = result.positions[rows, gap.marker]
        result.positions[rows, gap.marker] = (1 - share) * positions + share * regressed.positions
        result.expected_error[rows, gap.marker] = averaged_error(error, other)


def _stretches(gaps: list[Gap], frames: int, border: int, piece: int) -> Iterator[tuple[int, int, slice]]:
    """Yield the ends of the stretches to smooth, and the frames that take part.

    Stretches that overlap are one, and a long one is cut into pieces. Frames beside a piece take part too: as many as
    the longest gap has, so that no gap is smoothed without its ends.
    """
    covered, reach = np.zeros(frames, dtype=np.bool_), border
    for gap in gaps:
        covered[max(gap.start - border, 0) : gap.stop + border] = True
        reach = max(reach, gap.length + border)
    for start, stop in runs(covered):
        if stop - start < 3:
            continue
        count = max(round((stop - start) / piece), 1)
        cuts = np.linspace(start, stop, count + 1).astype(int).tolist()
        for first, last in pairwise(cuts):
            yield first, last, slice(max(first - reach, start), min(last + reach, stop))


def _stretch(
    model: MarkerModel, measured: Array, visible: Mask, places: Array, prior: MotionPrior, options: SmoothFillOptions
) -> Stretch:
    targets = np.where(visible[..., None], measured, 0.0)
    weights = visible / options.marker_noise**2
    size = 6 if model.is_rigid else 26
    return Stretch(model.kinematics.chain, model.bodies, places, targets, weights, prior, size)


def _wander(places: Array, whole: Mask, time: Array, constant: float) -> Array:
    """Return how far markers move on their bodies (T, M) in a time since they were seen, metres.

    places: (T, M, 3) metres, body frames; whole: (T, M) where they were seen.
    time: (T, M) seconds; constant: seconds in which all of the motion happens.
    """
    counts = np.maximum(whole.sum(axis=0), 1)[:, None]
    seen = np.where(whole[..., None], places, 0.0)
    mean = seen.sum(axis=0) / counts
    variance = np.sum(np.where(whole[..., None], (places - mean) ** 2, 0.0), axis=(0, 2)) / counts[:, 0]
    return np.asarray(np.sqrt(variance * (1 - np.exp(-2 * time / constant))))


def _positions(model: MarkerModel, poses: Array, offsets: Array) -> Array:
    """Return the markers (T, M, 3) at offsets (T, M, 3) in the frames of their bodies."""
    T = model.kinematics.transforms(poses)[:, model.bodies]
    return np.asarray(np.einsum("tmij,tmj->tmi", T[..., :3, :3], offsets) + T[..., :3, 3])


def _spread(model: MarkerModel, smoothed: Smoothed, offsets: Array, visible: Mask, size: int) -> Array:
    """Return the root mean square distance (T, M) of the posterior from its mean, metres."""
    tangents = posterior_samples(smoothed, _DRAWS, size)
    squared = np.zeros(visible.shape)
    points = _positions(model, smoothed.poses, offsets)
    for frame in np.flatnonzero(~visible.all(axis=1)):
        J = model.kinematics.point_jacobian(smoothed.poses[frame], model.bodies, points[frame])
        moved = np.einsum("mij,sj->smi", J, tangents[:, frame])
        squared[frame] = np.mean(np.sum(moved**2, axis=-1), axis=0)
    return np.asarray(np.sqrt(squared))
