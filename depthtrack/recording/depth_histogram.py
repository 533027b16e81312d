"""Histograms of the stored values of depth images."""

import numpy as np

from depthtrack.errors import DamagedFrameError
from depthtrack.recording.sequence import Frame, Sequence
from depthtrack.types import Index

STORED_VALUES = 1 << 16
"""Number of values of a 16-bit depth image."""
LARGEST_STORED = STORED_VALUES - 1


def sampled_histogram(sequence: Sequence, count: int = 8) -> Index:
    """Return the count of pixels (65536,) of each stored value in a few readable frames."""
    histogram: Index = np.zeros(STORED_VALUES, dtype=np.int64)
    for index in np.unique(np.linspace(0, len(sequence) - 1, count).astype(int)):
        try:
            add_stored(histogram, sequence[int(index)])
        except DamagedFrameError:
            continue
    return histogram


def add_stored(histogram: Index, frame: Frame) -> None:
    """Add the pixels of a frame to the count (65536,) of each stored value."""
    units = np.rint(frame.depth / np.float32(frame.camera.depth_scale)).clip(0, LARGEST_STORED).astype(np.uint16)
    histogram += np.bincount(units.ravel(), minlength=STORED_VALUES)


def percentile(histogram: Index, share: float) -> float:
    """Return the stored value that a share of the readings does not exceed."""
    readings = histogram.copy()
    readings[0] = 0
    total = np.cumsum(readings)
    return float(np.searchsorted(total, share * total[-1]))
