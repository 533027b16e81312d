"""How much a track trembles."""

import numpy as np

from depthtrack.evaluation.metrics.metric import Metric
from depthtrack.types import Array

_LONGEST_STEP = 1.5
"""Usual intervals between frames; across a longer gap, and beside it, nothing is said."""


def jitter(points: Array, timestamps: Array) -> Metric:
    """Distance of each point from the straight line between where it was and where it will be; mean, each frame, mm.

    `points` (T, P, 3) metres, NaN rows where there are none; `timestamps` (T,) seconds. Half the second difference of
    the positions, the measure of smoothness of Kanazawa et al., "Learning 3D human dynamics from video", CVPR 2019
    (their acceleration), in millimetres and without the frame rate squared. A hand that accelerates has some of it
    without any trembling: 5 m/s^2 give 2.8 mm at 30 Hz. Noise of sigma in every coordinate gives about 1.95 sigma.
    """
    return Metric("jitter_mm", "mm", _trembling(points, timestamps))


def added_jitter(points: Array, true_points: Array, timestamps: Array) -> Metric:
    """`jitter` of the error `points` - `true_points`: what the tracker adds to the movement itself, mm.

    The acceleration error of Kanazawa et al. 2019, likewise.
    """
    return Metric("added_jitter_mm", "mm", _trembling(points - true_points, timestamps))


def _trembling(points: Array, timestamps: Array) -> Array:
    out = np.full(len(points), np.nan)
    if len(points) < 3:
        return out
    steps = np.diff(timestamps)
    even = steps < _LONGEST_STEP * np.median(steps)
    # Frames are not quite evenly spaced: the line is followed to the very moment between its ends.
    share = (steps[:-1] / (steps[:-1] + steps[1:]))[:, None, None]
    expected = points[:-2] + share * (points[2:] - points[:-2])
    distance = 1000 * np.linalg.norm(points[1:-1] - expected, axis=-1).mean(axis=-1)
    out[1:-1] = np.where(even[:-1] & even[1:], distance, np.nan)
    return out
