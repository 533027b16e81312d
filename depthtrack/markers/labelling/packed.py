"""The points of all frames of a capture in one array, without their trajectories."""

from typing import NamedTuple

import numpy as np

from depthtrack.markers.capture import MarkerCapture
from depthtrack.types import Array, Index


class PackedPoints(NamedTuple):
    """N points of T frames.

    position: (N, 3) metres, capture frame.
    ends: (T + 1,) the points of frame t are `ends[t]` to `ends[t + 1] - 1`.
    frame: (N,) frame of each point.
    column: (N,) trajectory of each point in its capture.
    """

    position: Array
    ends: Index
    frame: Index
    column: Index

    @staticmethod
    def of(capture: MarkerCapture) -> "PackedPoints":
        """Return the measured points of a capture."""
        measured = np.isfinite(capture.positions).all(axis=-1)
        frame, column = np.nonzero(measured)
        ends = np.concatenate([[0], np.cumsum(measured.sum(axis=1))])
        position = np.ascontiguousarray(capture.positions[frame, column], dtype=np.float64)
        return PackedPoints(position, ends.astype(np.int64), frame.astype(np.int64), column.astype(np.int64))

    def columns(self, labels: Index) -> Index:
        """Return the trajectories of numbered points, of any shape; -1 where there is none."""
        if len(self.column) == 0:
            return np.full(labels.shape, -1, np.int64)
        return np.where(labels >= 0, self.column[np.maximum(labels, 0)], -1)
