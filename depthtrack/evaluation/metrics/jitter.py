"""Jitter: high-frequency movement of the tracked points."""

import numpy as np

from depthtrack.evaluation.metrics.metric import Metric
from depthtrack.types import Array

_LONGEST_STEP = 1.5
"""Longest interval between frames that is no gap, in median intervals."""


def jitter(points: Array, timestamps: Array) -> Metric:
    """Return the mean distance of the points from the line between their two neighbours in time.

    points: (T, P, 3), m; NaN if unknown.
    timestamps: (T,), s.

    This is half the second difference of the positions: the acceleration of Kanazawa et al., "Learning 3D human
    dynamics from video", CVPR 2019, in millimetres without the squared frame rate. A smooth acceleration of 5 m/s^2
    gives 2.8 mm at 30 Hz. Noise of sigma in every coordinate gives about 1.95 sigma. Frames beside a gap are NaN.
    """
    return Metric("jitter_mm", "mm", _second_difference(points, timestamps))


def added_jitter(points: Array, true_points: Array, timestamps: Array) -> Metric:
    """Return the jitter of the error, which is the part that the tracker adds to the movement.

    points, true_points: (T, P, 3), m; NaN if unknown.
    timestamps: (T,), s.

    This is the acceleration error of Kanazawa et al. 2019, scaled as in `jitter`.
    """
    return Metric("added_jitter_mm", "mm", _second_difference(points - true_points, timestamps))


def _second_difference(points: Array, timestamps: Array) -> Array:
    """Return the mean distance (T,) of the points from the line between their neighbours, mm."""
    out = np.full(len(points), np.nan)
    if len(points) < 3:
        return out
    steps = np.diff(timestamps)
    even = steps < _LONGEST_STEP * np.median(steps)
    # Intervals vary, so the position on the line follows from the time of the frame.
    share = (steps[:-1] / (steps[:-1] + steps[1:]))[:, None, None]
    expected = points[:-2] + share * (points[2:] - points[:-2])
    distance = 1000 * np.linalg.norm(points[1:-1] - expected, axis=-1).mean(axis=-1)
    out[1:-1] = np.where(even[:-1] & even[1:], distance, np.nan)
    return out
