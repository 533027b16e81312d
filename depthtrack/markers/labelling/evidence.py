"""Assignment of tracklets to markers by the evidence of all their frames."""

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.markers.labelling.capture_fit import ExpectedFrames
from depthtrack.markers.labelling.hungarian import assign_rows
from depthtrack.markers.labelling.packed import PackedPoints
from depthtrack.markers.labelling.prediction import mahalanobis
from depthtrack.markers.labelling.state import Settings
from depthtrack.types import Array, Index, Mask

LEAST, MOST = -20.0, 12.0
"""Limits of the log-likelihood ratio of one frame: no single frame decides."""
CONTEST = -10.0
"""Log-likelihood ratio from which on a point contests a label."""


def tracklet_evidence(points: PackedPoints, tracklet: Index, expected: ExpectedFrames, settings: Settings) -> Array:
    """Return the log-likelihood ratio (K, M) of K tracklets being a marker or clutter."""
    out = np.zeros((int(tracklet.max(initial=-1)) + 1, expected.position.shape[1]))
    _add_evidence(points.position, points.frame, tracklet, expected, settings.clutter, out)
    return out


@compiled(nogil=True)
def _add_evidence(
    position: Array, frame: Index, tracklet: Index, expected: ExpectedFrames, clutter: float, out: Array
) -> None:
    for n in range(position.shape[0]):
        t, k = frame[n], tracklet[n]
        for i in range(out.shape[1]):
            out[k, i] += frame_evidence(expected, clutter, t, i, position[n])


@compiled(nogil=True)
def frame_evidence(expected: ExpectedFrames, clutter: float, t: int, i: int, point: Array) -> float:
    """Return the log-likelihood ratio of a point (3,) of frame t being marker i or clutter."""
    if np.isnan(expected.position[t, i, 0]):
        return LEAST
    square = mahalanobis(expected.precision[t, i], expected.position[t, i], point)
    return float(min(max(expected.peak[t, i] - clutter - 0.5 * square, LEAST), MOST))


def contested(points: PackedPoints, tracklet: Index, labels: Index, expected: ExpectedFrames, clutter: float) -> Mask:
    """Return whether each tracklet (K,) has a rival without a label in most of its frames.

    The fit follows the points that it is given. So a ghost with a label makes the true point unlikely.
    """
    labelled = np.zeros(len(points.position), np.bool_)
    labelled[labels[labels >= 0]] = True
    doubtful = np.zeros(len(points.position), np.bool_)
    _find_contested(points.position, points.frame, labels, labelled, expected, clutter, doubtful)
    return np.asarray(2 * np.bincount(tracklet, weights=doubtful) > np.bincount(tracklet))


@compiled(nogil=True)
def _find_contested(
    position: Array,
    frame: Index,
    labels: Index,
    labelled: Mask,
    expected: ExpectedFrames,
    clutter: float,
    out: Mask,
) -> None:
    for n in range(position.shape[0]):
        if labelled[n]:
            continue
        t = frame[n]
        for i in range(labels.shape[1]):
            if labels[t, i] >= 0 and not np.isnan(expected.position[t, i, 0]):
                square = mahalanobis(expected.precision[t, i], expected.position[t, i], position[n])
                if expected.peak[t, i] - clutter - 0.5 * square > CONTEST:
                    out[labels[t, i]] = True


def assign_tracklets(points: PackedPoints, tracklet: Index, evidence: Array) -> Index:
    """Return the marker (K,) of each tracklet, -1 for none; no marker has two points in a frame.

    Each set of tracklets that are present together is assigned by the Hungarian method. A tracklet takes the marker
    that most of its frames give it, the clearest first.
    """
    K, M = evidence.shape
    votes = np.zeros((K, M), np.int64)
    _vote(points.ends, tracklet, evidence, votes)
    frames = np.bincount(tracklet, minlength=K)
    pairs = np.argwhere(2 * votes > frames[:, None])
    order = np.argsort(-votes[tuple(pairs.T)] * evidence[tuple(pairs.T)], kind="stable")
    begin = np.full(K, np.iinfo(np.int64).max)
    np.minimum.at(begin, tracklet, points.frame)
    marker, taken = np.full(K, -1, np.int64), np.zeros((M, len(points.ends) - 1), np.bool_)
    _take(pairs[order], begin, begin + frames, taken, marker)
    return marker


@compiled(nogil=True)
def _take(pairs: Index, begin: Index, end: Index, taken: Mask, marker: Index) -> None:
    """Give each tracklet of the pairs (P, 2) its marker, if that has no point in its frames."""
    for n in range(pairs.shape[0]):
        k, i = pairs[n]
        if marker[k] < 0 and not taken[i, begin[k] : end[k]].any():
            marker[k] = i
            taken[i, begin[k] : end[k]] = True


@compiled(nogil=True)
def _vote(ends: Index, tracklet: Index, evidence: Array, votes: Index) -> None:
    """Count for each tracklet the frames in which the best assignment gives it each marker."""
    M = evidence.shape[1]
    last, chosen, count = np.empty(0, np.int64), np.empty(0, np.int64), 0
    for t in range(ends.shape[0] - 1):
        present = np.sort(tracklet[ends[t] : ends[t + 1]])
        count = present.shape[0]
        same = count == last.shape[0]
        for n in range(count if same else 0):
            same &= present[n] == last[n]
        if not same:
            last, chosen = present, np.empty(count, np.int64)
            cost = np.zeros((count, M + count))
            for n in range(count):
                for i in range(M):
                    value = evidence[present[n], i]
                    cost[n, i] = -value if value > 0 else 1.0
            assign_rows(cost, count, M + count, chosen)
        for n in range(count):
            if chosen[n] < M:
                votes[present[n], chosen[n]] += 1


def label_points(points: PackedPoints, tracklet: Index, marker: Index, count: int) -> Index:
    """Return the points (T, M) of M markers from the markers of tracklets; -1 for none."""
    labels = np.full((len(points.ends) - 1, count), -1, np.int64)
    chosen = marker[tracklet]
    n = np.flatnonzero(chosen >= 0)
    labels[points.frame[n], chosen[n]] = n
    return labels
