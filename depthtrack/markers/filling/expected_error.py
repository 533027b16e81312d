"""Expected error of filled samples: the factors are calibrated on synthetic captures.

`smooth` knows its error up to a factor: from the posterior distribution of the postures, and from held-out parts of the
capture. For the other methods the error grows with the time to the nearest measured frame of the marker. For the
baselines it is scaled by that of held-out stretches of the capture, see `held_out`.
"""

import numpy as np

from depthtrack.markers.filling.options import FillMethod
from depthtrack.types import Array

_SPREAD_FACTOR, _MISS_FACTOR, _AVERAGE_FACTOR = 1.0, 1.0, 1.2
"""Error of the smoothed postures over the posterior's spread, of the regression over its misses, and of the average."""
_LEAST = 0.0005
"""Smallest error, metres."""
_POWER_LAWS: dict[FillMethod, tuple[float, float]] = {
    "paper": (0.04, 0.67),
    "spline": (0.122, 1.1),
    "pattern": (0.023, 0.5),
    "pca": (0.0145, 0.55),
}
"""Error one second from the nearest measured frame, metres, and exponent of its growth with that time."""


def spread_error(spread: Array) -> Array:
    """Return the error, metres, of smoothed markers with a spread of the posterior, metres."""
    return np.asarray(np.hypot(_SPREAD_FACTOR * spread, _LEAST))


def regression_error(misses: Array) -> Array:
    """Return the root mean square error, metres, of the regression with held-out misses, metres."""
    return np.asarray(np.hypot(_MISS_FACTOR * misses, _LEAST))


def averaged_error(a: Array, b: Array) -> Array:
    """Return the error, metres, of an average by precision of estimates with errors a and b."""
    return np.asarray(_AVERAGE_FACTOR * a * b / np.hypot(a, b))


def error_after(method: FillMethod, time: Array) -> Array:
    """Return the error, metres, at a time from the nearest measured frame, seconds."""
    scale, exponent = _POWER_LAWS[method]
    return np.asarray(np.hypot(scale * time**exponent, _LEAST))
