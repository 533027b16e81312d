"""Tracklets that change from one marker to another are cut.

Cameras merge markers that are close. The point then goes on with either of them, and a link cannot show which.
"""

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.markers.labelling.capture_fit import ExpectedFrames
from depthtrack.markers.labelling.evidence import frame_evidence
from depthtrack.markers.labelling.packed import PackedPoints
from depthtrack.markers.labelling.state import Settings
from depthtrack.types import Array, Index


def split_tracklets(
    points: PackedPoints, tracklet: Index, expected: ExpectedFrames, settings: Settings, gain: float
) -> Index:
    """Return the tracklet (N,) of each point; those that fit two markers better are cut.

    gain: least increase of the log-likelihood ratio by a cut.
    """
    members = np.argsort(tracklet, kind="stable")
    starts = np.concatenate([[0], np.cumsum(np.bincount(tracklet))]).astype(np.int64)
    out, count = tracklet.copy(), len(starts) - 1
    cuts = np.full(count, -1, np.int64)
    _find_cuts(points.position, points.frame, members, starts, expected, settings.clutter, gain, cuts)
    for number, k in enumerate(np.flatnonzero(cuts >= 0)):
        out[members[cuts[k] : starts[k + 1]]] = count + number
    return out


@compiled(nogil=True)
def _find_cuts(
    position: Array,
    frame: Index,
    members: Index,
    starts: Index,
    expected: ExpectedFrames,
    clutter: float,
    gain: float,
    cuts: Index,
) -> None:
    """Write the place in `members` of the best cut of each tracklet; -1 if no cut gains enough."""
    M = expected.position.shape[1]
    for k in range(starts.shape[0] - 1):
        count = starts[k + 1] - starts[k]
        sums = np.zeros((count + 1, M))
        for n in range(count):
            p = members[starts[k] + n]
            for i in range(M):
                sums[n + 1, i] = sums[n, i] + frame_evidence(expected, clutter, frame[p], i, position[p])
        best = max(sums[count].max(), 0.0) + gain
        for n in range(1, count):
            value = max(sums[n].max(), 0.0) + max((sums[count] - sums[n]).max(), 0.0)
            if value > best:
                best, cuts[k] = value, starts[k] + n
