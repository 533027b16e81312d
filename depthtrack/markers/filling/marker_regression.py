"""Where the other markers of a hand place a missing one: a linear regression.

In the frame of the palm, the position of the missing marker is a linear function of the others and of the palm's
orientation. Frames near the gap weigh more. The error is that of held-out blocks of the capture, from which the
strength of the ridge is chosen too. What the regression misses at the ends of the gap fades out inside it.
"""

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from depthtrack.geometry.alignment import rigid_alignment
from depthtrack.markers.filled_capture import Gap, measured_samples
from depthtrack.markers.filling.options import RegressionOptions
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.types import Array, Index, Mask

_RIDGES = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2)
"""Strengths to choose from, relative to the variance of a coordinate of the markers."""
_MOST_FRAMES = 1000
"""Frames that are learned from; more are thinned out evenly."""
_FEWEST_BLOCKS = 4
_LEVER = 0.05
"""Distance that turns the palm's rotation into a length comparable with the markers', metres."""
_NUGGET = 0.01
"""Share of the error's variance that differs from frame to frame."""


class Regressed(NamedTuple):
    """Positions (n, 3) of the marker in its gap, metres, and their root mean square error (n,)."""

    positions: Array
    error: Array


def regress_marker(
    model: MarkerModel, measured: Array, filled: Array, gap: Gap, rate: float, options: RegressionOptions
) -> Regressed | None:
    """Return the marker of a gap; None if too little of the capture shows it with the others.

    measured: (T, M, 3) metres, NaN if not measured.
    filled: (T, M, 3) metres; `measured` with every missing position estimated.
    """
    visible = measured_samples(measured)
    inside = np.arange(gap.start, gap.stop)
    others = np.flatnonzero(visible[inside].mean(axis=0) >= options.visible_share)
    training = np.flatnonzero(visible[:, gap.marker] & np.isfinite(filled[:, others]).all(axis=(1, 2)))
    if len(others) < 3 or len(training) < options.fewest_seconds * rate:
        return None
    training = training[:: max(1, len(training) // _MOST_FRAMES)]
    R, t = _frames(model, filled, others)
    x = _features(R, np.einsum("tji,tmj->tmi", R, filled[:, others] - t[:, None]))
    y = np.einsum("tji,tj->ti", R, measured[:, gap.marker] - t)
    away = np.maximum(np.maximum(gap.start - training, training - gap.stop + 1), 0) / rate
    weight = 1 + options.local_weight * np.exp(-away / options.local_time)
    blocks = max(_FEWEST_BLOCKS, round(len(measured) / rate / options.block_time))
    fitted, missed = _ridge(x, y, training, weight, blocks)
    error = float(np.sqrt(np.mean(np.sum(missed**2, axis=1))))
    constant = _time_constant(missed, training, rate)
    correction, share = _from_ends(y - fitted, visible[:, gap.marker], gap, constant * rate, options.end_time * rate)
    placed = np.einsum("tij,tj->ti", R[inside], fitted[inside] + correction) + t[inside]
    return Regressed(placed, error * np.sqrt(share))


def _frames(model: MarkerModel, positions: Array, others: Index) -> tuple[Array, Array]:
    """Return rotation (T, 3, 3) and position (T, 3), metres, of a frame fixed to the palm.

    It is aligned with the markers of the palm, or with all others where fewer than three are on the palm.
    """
    palm = others[model.bodies[others] == 0]
    points = positions[:, palm if len(palm) >= 3 else others]
    whole = np.flatnonzero(np.isfinite(points).all(axis=(1, 2)))
    points = np.where(np.isfinite(points), points, points[whole[0]])
    shape = points[whole[len(whole) // 2]]
    for _ in range(2):
        R, t = rigid_alignment(shape, points)
        shape = np.einsum("tji,tmj->tmi", R, points - t[:, None])[whole].mean(axis=0)
    return rigid_alignment(shape, points)


def _features(R: Array, local: Array) -> Array:
    """Return the features (T, F), metres: markers (T, M, 3) and rotation of the palm."""
    turned = Rotation.from_matrix(R[len(R) // 2].T @ R).as_rotvec()
    return np.concatenate([local.reshape(len(local), -1), _LEVER * turned], axis=1)


def _ridge(x: Array, y: Array, training: Index, weight: Array, blocks: int) -> tuple[Array, Array]:
    """Return the regression of all frames (T, 3), and the misses (N, 3) when held out, metres.

    A block is held out in closed form: its misses are (I - H)^-1 times those of the fit, with its part H of the hat
    matrix.
    """
    centre, mean = np.average(x[training], axis=0, weights=weight), np.average(y[training], axis=0, weights=weight)
    root = np.sqrt(weight)[:, None]
    A, b = (x[training] - centre) * root, (y[training] - mean) * root
    values, axes = np.linalg.eigh(A.T @ A)
    rows, projected = A @ axes, axes.T @ (A.T @ b)
    level = values.sum() / len(values)
    parts = np.array_split(np.arange(len(training)), min(blocks, len(training)))
    best: tuple[float, Array, Array] | None = None
    for ridge in _RIDGES:
        inverse = 1 / (np.maximum(values, 0) + ridge * level)
        misses = b - rows @ (inverse[:, None] * projected)
        for part in parts:
            H = rows[part] * inverse @ rows[part].T
            misses[part] = np.linalg.solve(np.eye(len(part)) - H, misses[part])
        misses = misses / root
        score = float(np.sum(misses**2))
        if best is None or score < best[0]:
            best = score, axes @ (inverse[:, None] * projected), misses
    assert best is not None
    return (x - centre) @ best[1] + mean, best[2]


def _time_constant(misses: Array, training: Index, rate: float) -> float:
    """Return the standard deviation of the misses over that of their velocity, seconds."""
    steps = np.diff(training)
    near = steps <= 3 * np.median(steps)
    velocity = np.diff(misses, axis=0)[near] * rate / steps[near, None]
    return float(np.sqrt(np.mean(misses**2) / max(np.mean(velocity**2), 1e-12)))


def _from_ends(misses: Array, visible: Mask, gap: Gap, constant: float, reach: float) -> tuple[Array, Array]:
    """Return the correction (n, 3) of a gap, metres, and the share (n,) of variance left.

    misses: (T, 3) of the regression where the marker is visible (T,).
    constant, reach: frames.

    Kriging with the Matern kernel of smoothness 3/2, from a few frames on both sides.
    """
    step = max(1, round(reach / 5))
    sides = [np.arange(gap.start - 1, gap.start - 1 - reach, -step), np.arange(gap.stop, gap.stop + reach, step)]
    ends = np.concatenate(sides).astype(np.int64)
    ends = ends[(ends >= 0) & (ends < len(visible))]
    ends = ends[visible[ends]]
    inside = np.arange(gap.start, gap.stop)

    def kernel(a: Index, b: Index) -> Array:
        distance = np.abs(a[:, None] - b) / max(constant, 1e-9)
        return np.asarray((1 + distance) * np.exp(-distance))

    among, across = kernel(ends, ends) + _NUGGET * np.eye(len(ends)), kernel(inside, ends)
    solved = np.linalg.solve(among, across.T)
    remaining = 1 + _NUGGET - np.einsum("ij,ji->i", across, solved)
    return np.asarray(solved.T @ misses[ends]), np.asarray(np.maximum(remaining, _NUGGET))
