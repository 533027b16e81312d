"""Expected error of filled samples, calibrated on synthetic captures."""

import numpy as np

from depthtrack.markers.filling.options import FillOptions
from depthtrack.markers.filling.prediction import Prediction, time_to_measured
from depthtrack.types import Array, Mask

SPREAD_FACTOR, SPREAD_FLOOR = 1.0, 0.001
"""Error of `smooth` over the spread of its posterior, and its smallest value, metres."""
POWER_LAWS = {"paper": (0.02, 0.001), "spline": (0.05, 0.001), "pattern": (0.03, 0.001), "pca": (0.01, 0.005)}
"""Error of the other methods: metres a second of distance in time from the nearest measured frame, and metres there."""


def expected_error(prediction: Prediction, measured: Mask, rate: float, options: FillOptions) -> Array:
    """Return the root mean square error (T, M) that a filled sample is expected to have, metres.

    measured: (T, M) whether a marker was measured.

    `smooth` states the spread of its posterior distribution. For the other methods the error grows with the time to the
    nearest measured frame of the marker.
    """
    if options.method == "smooth":
        return np.asarray(np.hypot(SPREAD_FACTOR * prediction.expected_error, SPREAD_FLOOR))
    slope, least = POWER_LAWS[options.method]
    return least + slope * time_to_measured(measured, rate)
