"""Assignment of tracklets to markers by the evidence of all their frames."""

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.markers.labelling.capture_fit import ExpectedFrames
from depthtrack.markers.labelling.hungarian import assign_rows
from depthtrack.markers.labelling.packed import PackedPoints
from depthtrack.markers.labelling.state import Settings
from depthtrack.types import Array, Index

LEAST, MOST = -20.0, 12.0
"""Limits of the log-likelihood ratio of one frame: no single frame decides."""


def tracklet_evidence(points: PackedPoints, tracklet: Index, expected: ExpectedFrames, settings: Settings) -> Array:
    """Return the summed log-likelihood ratio (K, M) of K tracklets being a marker against being clutter."""
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
            p, variance = expected.position[t, i], expected.deviation[t, i] ** 2
            if np.isnan(p[0]):
                out[k, i] += LEAST
                continue
            x, y, z = position[n, 0] - p[0], position[n, 1] - p[1], position[n, 2] - p[2]
            ratio = -clutter - 1.5 * np.log(2 * np.pi * variance) - 0.5 * (x * x + y * y + z * z) / variance
            out[k, i] += min(max(ratio, LEAST), MOST)


def assign_tracklets(points: PackedPoints, tracklet: Index, evidence: Array) -> Index:
    """Return the marker (K,) of each tracklet, -1 for none; no marker has two points in a frame.

    Each set of tracklets that are present together is assigned by the Hungarian method. A tracklet takes the marker
    that most of its frames give it, the clearest first.
    """
    K, M = evidence.shape
    votes = np.zeros((K, M), np.int64)
    _vote(points.ends, tracklet, evidence, votes)
    marker = np.full(K, -1, np.int64)
    frames = np.bincount(tracklet, minlength=K)
    begin = np.full(K, np.iinfo(np.int64).max)
    np.minimum.at(begin, tracklet, points.frame)
    end = begin + frames
    taken: list[list[tuple[int, int]]] = [[] for _ in range(M)]
    wanted = np.argwhere(votes > 0)
    order = np.argsort(-(votes[tuple(wanted.T)] * 1.0) * evidence[tuple(wanted.T)], kind="stable")
    for k, i in wanted[order]:
        if marker[k] >= 0 or 2 * votes[k, i] <= frames[k]:
            continue
        if all(end[k] <= a or b <= begin[k] for a, b in taken[i]):
            marker[k] = i
            taken[i].append((int(begin[k]), int(end[k])))
    return marker


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
