"""What a filling method returns, and the samples that it may fill."""

from typing import NamedTuple

import numpy as np

from depthtrack.markers.filled_capture import Gap, gaps_of
from depthtrack.markers.filling.options import FillOptions
from depthtrack.types import Array, Index, Mask


class Prediction(NamedTuple):
    """Markers of a model wherever a method gives them.

    positions: (T, M, 3) metres, capture frame, NaN where it gives none.
    how: (T, M) `Filling`.
    expected_error: (T, M) metres.
    poses: (T, 27) capture frame.
    """

    positions: Array
    how: Index
    expected_error: Array
    poses: Array


def gaps_to_fill(model: int, measured: Mask, rate: float, options: FillOptions) -> list[Gap]:
    """Return the gaps of a model that the options ask to fill.

    measured: (T, M).
    """
    frames = len(measured)
    return [
        gap
        for gap in gaps_of(model, measured)
        if gap.length <= round(options.longest * rate)
        and gap.length < frames
        and (options.ends or (gap.start > 0 and gap.stop < frames))
    ]


def time_to_measured(measured: Mask, rate: float) -> Array:
    """Return the time (T, M) to the nearest frame with the marker, seconds."""
    frames = np.arange(len(measured), dtype=np.float64)
    distance = np.full(measured.shape, np.inf)
    for m in range(measured.shape[1]):
        known = np.flatnonzero(measured[:, m]).astype(np.float64)
        if len(known) > 0:
            after = np.searchsorted(known, frames)
            left = np.abs(frames - known[np.maximum(after - 1, 0)])
            right = np.abs(frames - known[np.minimum(after, len(known) - 1)])
            distance[:, m] = np.minimum(left, right)
    return distance / rate
