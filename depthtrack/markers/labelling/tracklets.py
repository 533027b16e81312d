"""Tracklets: points linked from frame to frame where the link is not ambiguous."""

from typing import NamedTuple

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.markers.labelling.options import LabellingOptions
from depthtrack.markers.labelling.packed import PackedPoints
from depthtrack.types import Array, Index


class LinkSettings(NamedTuple):
    """Limits of a link.

    rate: Hz.
    noise: standard deviation of a coordinate, metres.
    acceleration: standard deviation of the change of a point's motion, m/frame.
    speed: the same for a point without a known motion, m/frame.
    gate: largest distance of a link, standard deviations.
    clear: the next best link must be farther by this number of standard deviations of a known motion.
    """

    rate: float
    noise: float
    acceleration: float
    speed: float
    gate: float
    clear: float

    @staticmethod
    def of(options: LabellingOptions, rate: float) -> "LinkSettings":
        """Return the settings for a frame rate, Hz."""
        p, o = options.prediction, options.offline
        return LinkSettings(rate, p.noise, p.acceleration / rate**2, o.link_speed / rate, o.link_gate, o.link_clear)


def make_tracklets(points: PackedPoints, settings: LinkSettings) -> Index:
    """Return the tracklet (N,) of each point, numbered from 0 by first frame."""
    previous = np.full(len(points.position), -1, np.int64)
    _link(points.position, points.ends, settings, previous)
    tracklet = np.empty(len(previous), np.int64)
    _number(previous, tracklet)
    return tracklet


@compiled(nogil=True)
def _number(previous: Index, out: Index) -> None:
    count = 0
    for n in range(previous.shape[0]):
        if previous[n] >= 0:
            out[n] = out[previous[n]]
        else:
            out[n] = count
            count += 1


@compiled(nogil=True)
def _link(position: Array, ends: Index, settings: LinkSettings, previous: Index) -> None:
    """Write the point of the frame before that each point continues.

    A link joins mutual nearest neighbours of a point that goes on with its velocity. A point without one takes the
    velocity of the nearest point that has one.
    """
    velocity = np.zeros(position.shape)
    known = np.zeros(position.shape[0], np.bool_)
    apart = settings.clear * (2 * settings.noise + settings.acceleration)
    for t in range(1, ends.shape[0] - 1):
        a, b, c = ends[t - 1], ends[t], ends[t + 1]
        rows, columns = b - a, c - b
        if rows == 0 or columns == 0:
            continue
        distance = np.empty((rows, columns))
        expected, largest = np.empty(3), np.empty(rows)
        for i in range(rows):
            v, own = velocity[a + i], known[a + i]
            if not own:
                nearest = 0.15
                for k in range(rows):
                    if known[a + k]:
                        far = _distance(position[a + i], position[a + k])
                        if far < nearest:
                            nearest, v = far, velocity[a + k]
            for r in range(3):
                expected[r] = position[a + i, r] + v[r]
            largest[i] = settings.gate * (2 * settings.noise + (settings.acceleration if own else settings.speed))
            for j in range(columns):
                distance[i, j] = _distance(expected, position[b + j])
        for i in range(rows):
            best = _nearest(distance[i])
            least = distance[i, best]
            if least > largest[i] or _nearest(distance[:, best]) != i:
                continue
            clear = True
            for j in range(columns):
                clear &= j == best or distance[i, j] > least + apart
            for k in range(rows):
                clear &= k == i or distance[k, best] > least + apart
            if clear:
                n, before = b + best, a + i
                previous[n], known[n] = before, True
                for r in range(3):
                    moved = position[n, r] - position[before, r]
                    velocity[n, r] = moved if not known[before] else 0.3 * velocity[before, r] + 0.7 * moved


@compiled(nogil=True)
def _nearest(distances: Array) -> int:
    best = 0
    for j in range(1, distances.shape[0]):
        if distances[j] < distances[best]:
            best = j
    return best


@compiled(nogil=True)
def _distance(x: Array, y: Array) -> float:
    return np.sqrt((x[0] - y[0]) ** 2 + (x[1] - y[1]) ** 2 + (x[2] - y[2]) ** 2)
