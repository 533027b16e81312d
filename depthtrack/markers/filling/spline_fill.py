"""Baseline: a cubic spline per marker, in space ("spline fill")."""

import numpy as np
from scipy.interpolate import CubicSpline

from depthtrack.markers.filled_capture import Gap, measured_samples
from depthtrack.types import Array

_FRAMES = 10
"""Measured frames on either side of a gap that the spline passes through."""


def spline_fill(measured: Array, gaps: list[Gap]) -> Array:
    """Return the positions (T, M, 3) of the markers of a model in its gaps, NaN elsewhere.

    measured: (T, M, 3) metres, NaN if not measured.

    The spline of a coordinate passes through the measured frames about the gap ("not a knot" at its ends).
    A gap at an end of the capture stays.
    """
    filled = np.full(measured.shape, np.nan)
    for gap in gaps:
        track = measured[:, gap.marker]
        seen = np.flatnonzero(measured_samples(track))
        before, after = seen[seen < gap.start][-_FRAMES:], seen[seen >= gap.stop][:_FRAMES]
        if len(before) > 0 and len(after) > 0:
            known = np.concatenate([before, after])
            frames = np.arange(gap.start, gap.stop)
            filled[frames, gap.marker] = CubicSpline(known, track[known])(frames)
    return filled
