"""Trajectories without models: tracklets, joined over gaps.

A marker that reappears is expected where its own velocity leads, and where the rigid motion of its neighbours does. The
more likely of the two counts. All ends and beginnings are assigned at once, again and again, since joined trajectories
are neighbours of others.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from depthtrack.geometry.alignment import rigid_alignment
from depthtrack.markers.capture import UNLABELLED, MarkerCapture
from depthtrack.markers.labelling.packed import PackedPoints
from depthtrack.markers.labelling.tracklets import LinkSettings, make_tracklets
from depthtrack.options import check_ranges, option
from depthtrack.types import Array, Index


@dataclass(frozen=True)
class LinkingOptions:
    """Trajectories without models."""

    noise: float = option(0.0007, "Standard deviation of a measured coordinate", unit="m", least=1e-6)
    acceleration: float = option(50.0, "Standard deviation of a marker's acceleration", unit="m/s^2", least=1e-4)
    speed: float = option(
        0.5, "Standard deviation of the speed of a point without a known motion", unit="m/s", least=1e-4
    )
    gate: float = option(3.0, "Largest distance of a link between frames", unit="standard deviations")
    clear: float = option(2.0, "By how much farther the next best link must be", unit="standard deviations")
    longest_gap: float = option(1.0, "Longest gap that is joined", unit="s")
    neighbours: int = option(6, "Neighbours whose rigid motion is used", least=3, most=1000)
    neighbour_range: float = option(0.15, "Distance at which a neighbour has 0.6 of its weight", unit="m", least=1e-4)
    deformation: float = option(0.1, "Growth of the neighbours' uncertainty over a gap", unit="m/s")
    clutter: float = option(20.0, "Expected density of points without a marker", unit="1/m^3", least=1e-6, most=1000000)
    rounds: int = option(8, "Rounds of joining, each over longer gaps", least=1, most=1000)

    def __post_init__(self) -> None:
        check_ranges(self)


def link_capture(capture: MarkerCapture, options: LinkingOptions | None = None) -> MarkerCapture:
    """Return the points of a capture in new trajectories `*1`, `*2`, ...

    Trajectories are in the order of their first frames.
    """
    options = options or LinkingOptions()
    points, dt = PackedPoints.of(capture), 1 / capture.rate
    links = LinkSettings(
        capture.rate, options.noise, options.acceleration * dt * dt, options.speed * dt, options.gate, options.clear
    )
    member = make_tracklets(points, links)
    longest = max(1, round(options.longest_gap * capture.rate))
    # Short gaps come first, so that a join does not pass over a trajectory in its gap.
    for limit in np.unique(np.geomspace(1, longest, options.rounds).round().astype(int)):
        while not np.array_equal(joined := _join(points, member, options, dt, int(limit)), member):
            member = joined
    return _capture_of(capture, points, member)


def _capture_of(capture: MarkerCapture, points: PackedPoints, member: Index) -> MarkerCapture:
    count = int(member.max(initial=-1)) + 1
    positions = np.full((len(capture), count, 3), np.nan)
    positions[points.frame, member] = points.position
    residuals = None
    if capture.residuals is not None:
        residuals = np.full((len(capture), count), np.nan)
        residuals[points.frame, member] = capture.residuals[points.frame, points.column]
    labels = tuple(f"{UNLABELLED}{n + 1}" for n in range(count))
    return replace(capture, labels=labels, positions=positions, residuals=residuals)


def _join(points: PackedPoints, member: Index, options: LinkingOptions, dt: float, longest: int) -> Index:
    """Return the trajectory (N,) of each point, joined over at most `longest` frames."""
    count = int(member.max(initial=-1)) + 1
    tracks = np.full((len(points.ends) - 1, count, 3), np.nan)
    tracks[points.frame, member] = points.position
    present = np.isfinite(tracks[..., 0])
    first, last = present.argmax(axis=0), len(tracks) - 1 - present[::-1].argmax(axis=0)
    rows, columns, values = list[int](), list[int](), list[float]()
    for a, b, gap in _candidates(tracks, first, last, options, dt, longest):
        value = _score(tracks, a, b, int(last[a]), int(first[b]), gap * dt, options, dt)
        if value > 0:
            rows.append(a)
            columns.append(b)
            values.append(value)
    if not rows:
        return member
    ends, r = np.unique(rows, return_inverse=True)
    begins, c = np.unique(columns, return_inverse=True)
    score = np.zeros((len(ends), len(begins)))
    score[r, c] = values
    parent = np.arange(count)
    for i, j in zip(*linear_sum_assignment(-score), strict=True):
        if score[i, j] > 0:
            parent[begins[j]] = ends[i]
    for k in np.argsort(first, kind="stable"):
        parent[k] = parent[parent[k]]
    return np.asarray(np.unique(parent[member], return_inverse=True)[1], dtype=np.int64)


def _candidates(
    tracks: Array, first: Index, last: Index, options: LinkingOptions, dt: float, longest: int
) -> Iterator[tuple[int, int, int]]:
    """Yield each end and beginning that may be joined, and the frames between."""
    order = np.argsort(first, kind="stable")
    for a in range(len(first)):
        low, high = np.searchsorted(first[order], [last[a] + 1, last[a] + longest + 1])
        for b in order[low:high]:
            gap = int(first[b] - last[a])
            reach = 0.03 + 6 * options.speed * min(gap * dt, 0.5)
            if np.linalg.norm(tracks[first[b], b] - tracks[last[a], a]) < reach + 0.1:
                yield a, int(b), gap


def _score(
    tracks: Array, a: int, b: int, end: int, begin: int, seconds: float, options: LinkingOptions, dt: float
) -> float:
    """Return the log-likelihood ratio of a join against none."""
    x, y = tracks[end, a], tracks[begin, b]
    spread = 0.5 * options.acceleration * seconds**2 + 2 * options.noise
    ahead = x + _velocity(tracks[:, a], end, -1) * (begin - end)
    back = y - _velocity(tracks[:, b], begin, 1) * (begin - end)
    own = float(np.linalg.norm(ahead - y) + np.linalg.norm(back - x)) / 2
    found = [_density(own, spread)]
    shared = np.flatnonzero(np.isfinite(tracks[end, :, 0]) & np.isfinite(tracks[begin, :, 0]))
    if len(shared) >= 3:
        distance = np.linalg.norm(tracks[end, shared] - x, axis=1)
        nearest = shared[np.argsort(distance)[: options.neighbours]]
        weights = np.exp(-0.5 * (np.sort(distance)[: options.neighbours] / options.neighbour_range) ** 2) + 1e-9
        R, t = rigid_alignment(tracks[end, nearest], tracks[begin, nearest], weights)
        moved = tracks[end, nearest] @ R.T + t - tracks[begin, nearest]
        rigid = float(np.sqrt(weights @ (moved**2).sum(axis=1) / (3 * weights.sum())))
        spread = 2 * options.noise + 2 * rigid + options.deformation * seconds
        found.append(_density(float(np.linalg.norm(R @ x + t - y)), spread))
    return max(found) - float(np.log(options.clutter))


def _velocity(track: Array, frame: int, direction: int) -> Array:
    """Return the mean velocity (3,) of the last or first few frames of a trajectory, m/frame."""
    for count in (4, 3, 2, 1):
        other = frame + direction * count
        if 0 <= other < len(track) and np.isfinite(track[other, 0]):
            return np.asarray((track[frame] - track[other]) / (frame - other))
    return np.zeros(3)


def _density(distance: float, spread: float) -> float:
    return float(-1.5 * np.log(2 * np.pi * spread**2) - 0.5 * (distance / spread) ** 2)
