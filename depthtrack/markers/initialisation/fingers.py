"""Fingers on a palm: with a palm given, each finger takes its points by itself.

A table holds postures of each finger, with the markers they place. A palm is scored by the best posture of each finger.
The best choices of points of the five fingers are then combined such that no point is taken twice.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.hand.compiled_kinematics import BodyPoses
from depthtrack.hand.limits import LOWER, UPPER
from depthtrack.hand.pose import make_pose
from depthtrack.hand.size_parameters import COUNT
from depthtrack.markers.models.sized_fit import SizedFitter
from depthtrack.markers.models.sized_markers import COLUMNS, marker_jacobian, place_markers, set_sizes
from depthtrack.types import Array, Index, Mask

_DIP_SHARE = 2 / 3
"""Flexion of the last joint as a share of the one before it (Rijpkema and Girard 1991)."""
_STRIDE = 5
"""Every n-th posture scores all palms; no divisor of the steps of a grid, so that each angle takes all its values."""
_CHOICES = 6
"""Choices of points kept for each finger."""
_COMBINATIONS = 24
"""Combinations of fingers kept."""


@dataclass(frozen=True, eq=False)
class FingerTables:
    """Postures of the fingers of a hand, and the markers that they place.

    markers: (M,) markers, those of the palm first and then finger by finger.
    first: (7,) where the palm and each finger begin in `markers`; the last is M.
    angles: (F, N, 4) rad.
    places: (N, M, 3) metres, palm frame, in the order of `markers`.
    prior: (F, N) energy of the angles.
    precision: (M,) 1 / variance of the markers, m^-2, in that order.
    missing: energy of a marker without a point.
    """

    markers: Index
    first: Index
    angles: Array
    places: Array
    prior: Array
    precision: Array
    missing: float

    @staticmethod
    def of(fitter: SizedFitter, coarse: float, missing: float) -> "FingerTables":
        """Return the tables of a hand.

        coarse: standard deviation that the steps of the tables add, metres.
        """
        model = fitter.model
        finger = np.where(model.bodies == 0, -1, (np.asarray(model.bodies) - 1) // 3)
        markers = np.argsort(finger, kind="stable").astype(np.int64)
        first = np.concatenate([[0], np.cumsum([(finger == f).sum() for f in range(-1, 5)])]).astype(np.int64)
        grids = [_grid(f) for f in range(5)]
        angles = np.stack(grids)
        poses = make_pose(np.zeros(3), (1, 0, 0, 0), np.swapaxes(angles, 0, 1).reshape(-1, 20))
        covariance = np.linalg.inv(fitter.prior.precision)
        prior = np.empty(angles.shape[:2])
        for f in range(5):
            mine = slice(4 * f, 4 * f + 4)
            d = angles[f] - fitter.prior.mean[mine]
            prior[f] = 0.5 * np.einsum("ni,ij,nj->n", d, np.linalg.inv(covariance[mine, mine]), d)
        variance = size_variance(fitter) + 1 / fitter.weights + np.where(model.bodies == 0, 0.5, 1.0) * coarse**2
        places = np.ascontiguousarray(model.positions(poses)[:, markers])
        return FingerTables(markers, first, angles, places, prior, 1 / variance[markers], missing)

    @cached_property
    def count(self) -> int:
        """Number of markers."""
        return len(self.markers)

    def best(self, palms: Array, points: Array, count: int) -> Index:
        """Return the `count` of the palms T (P, 3, 4) with the least energy of the markers, the best first.

        Fingers may share points here. All palms are scored with a few postures, and the better ones with all.
        """
        few = np.argsort(self._scores(palms, points, _STRIDE), kind="stable")[: 2 * count]
        order = np.argsort(self._scores(palms[few], points, 1), kind="stable")[:count]
        return np.asarray(few[order])

    def _scores(self, palms: Array, points: Array, stride: int) -> Array:
        out = np.empty(len(palms))
        places, prior = self.places[::stride].copy(), self.prior[:, ::stride].copy()
        score_palms(palms, points, self.first, places, prior, self.precision, self.missing, out)
        return out

    def combinations(self, palm: Array, points: Array) -> tuple[Index, Array, Array]:
        """Return the best assignments (C, M) of points (K, 3), K <= 62, their energies and finger angles (C, 20)."""
        return self._combined(palm, points, np.full(self.count, -1), np.ones(5, np.bool_), True)

    def with_fingers_released(
        self, palm: Array, points: Array, assigned: Index, fingers: tuple[int, ...]
    ) -> tuple[Index, Array, Array]:
        """Return `combinations` of some fingers; the others and the palm keep their points `assigned` (M,)."""
        free = np.isin(np.arange(5), fingers)
        return self._combined(palm, points, assigned[self.markers], free, False)

    def _combined(
        self, palm: Array, points: Array, kept: Index, free: Mask, with_palm: bool
    ) -> tuple[Index, Array, Array]:
        assigned, energies, postures = combine_fingers(
            palm, points, kept, free, with_palm, self.first, self.places, self.prior, self.precision, self.missing
        )
        order = np.empty_like(assigned)
        order[:, self.markers] = assigned
        angles = np.concatenate([self.angles[f, postures[:, f]] for f in range(5)], axis=-1)
        return order, energies, angles


def _grid(finger: int) -> Array:
    """Return postures (108, 4) of a finger within its limits, rad."""
    low, high = LOWER[4 * finger : 4 * finger + 4], UPPER[4 * finger : 4 * finger + 4]

    def within(j: int, shares: tuple[float, ...]) -> Array:
        return np.asarray(low[j] + np.array(shares) * (high[j] - low[j]))

    if finger == 0:
        rest = within(1, (0.1, 0.5, 0.9)), within(2, (0.1, 0.4, 0.8)), within(3, (0.1, 0.3, 0.55, 0.85))
        return np.array(list(product(within(0, (0.1, 0.5, 0.9)), *rest)))
    bent = within(1, (0.12, 0.25, 0.4, 0.55, 0.72, 0.92)), within(2, (0.04, 0.2, 0.36, 0.52, 0.7, 0.9))
    steps = product(within(0, (0.15, 0.5, 0.85)), *bent)
    return np.array([(a, m, p, min(_DIP_SHARE * p, high[3])) for a, m, p in steps])


def size_variance(fitter: SizedFitter) -> Array:
    """Return the variance (M,) of the markers by the sizes of the hand, m^2, mean over the coordinates."""
    count = len(fitter.model.labels)
    pose = make_pose(np.zeros(3), (1, 0, 0, 0), fitter.prior.mean)
    bodies, places, J = BodyPoses.empty(), np.empty((count, 3)), np.empty((3, COLUMNS))
    set_sizes(fitter.markers, np.zeros(COUNT))
    place_markers(fitter.markers, bodies, pose, places)
    covariance, variance = np.linalg.inv(fitter.size_precision), np.empty(count)
    for i in range(count):
        marker_jacobian(fitter.markers, bodies, i, places[i], np.zeros(COUNT), J)
        variance[i] = np.trace(J[:, 26:] @ covariance @ J[:, 26:].T) / 3
    return variance


@compiled(nogil=True)
def _to_palm(T: Array, points: Array, out: Array) -> None:
    for k in range(points.shape[0]):
        d0, d1, d2 = points[k, 0] - T[0, 3], points[k, 1] - T[1, 3], points[k, 2] - T[2, 3]
        for j in range(3):
            out[k, j] = T[0, j] * d0 + T[1, j] * d1 + T[2, j] * d2


@compiled(nogil=True)
def _nearest(place: Array, points: Array, taken: int) -> tuple[float, int]:
    """Return squared distance and index of the nearest point whose bit is not in `taken`."""
    best, chosen = np.inf, -1
    for k in range(points.shape[0]):
        if (taken >> k) & 1:
            continue
        d0, d1, d2 = place[0] - points[k, 0], place[1] - points[k, 1], place[2] - points[k, 2]
        d = d0 * d0 + d1 * d1 + d2 * d2
        if d < best:
            best, chosen = d, k
    return best, chosen


@compiled(nogil=True)
def score_palms(
    palms: Array, points: Array, first: Index, places: Array, prior: Array, precision: Array, missing: float, out: Array
) -> None:
    """Write the least energy of the markers about each palm to `out` (P,)."""
    local = np.empty_like(points)
    for n in range(palms.shape[0]):
        _to_palm(palms[n], points, local)
        total = 0.0
        for i in range(first[0], first[1]):
            total += min(missing, 0.5 * precision[i] * _nearest(places[0, i], local, 0)[0])
        for f in range(5):
            if first[f + 1] == first[f + 2]:
                continue
            least = np.inf
            for p in range(places.shape[0]):
                energy = prior[f, p]
                for i in range(first[f + 1], first[f + 2]):
                    if energy >= least:
                        break
                    energy += min(missing, 0.5 * precision[i] * _nearest(places[p, i], local, 0)[0])
                least = min(least, energy)
            total += least
        out[n] = total


@compiled(nogil=True)
def combine_fingers(
    palm: Array,
    points: Array,
    kept: Index,
    free: Mask,
    with_palm: bool,
    first: Index,
    places: Array,
    prior: Array,
    precision: Array,
    missing: float,
) -> tuple[Index, Array, Index]:
    """See `FingerTables.combinations`; the postures (C, 5) instead of angles.

    kept: (M,) points of what is not `free` (5,) fingers, nor the palm if `with_palm`.
    """
    M = places.shape[1]
    local = np.empty_like(points)
    _to_palm(palm, points, local)
    count, taken = 1, np.zeros(_COMBINATIONS, np.int64)
    assigned, energies = np.full((_COMBINATIONS, M), -1, np.int64), np.zeros(_COMBINATIONS)
    postures = np.zeros((_COMBINATIONS, 5), np.int64)
    for i in range(M):
        assigned[0, i] = kept[i]
    for i in range(first[0], first[1]):
        if with_palm:
            assigned[0, i] = -1
    for f in range(5):
        if free[f]:
            assigned[0, first[f + 1] : first[f + 2]] = -1
    for i in range(M):
        if assigned[0, i] >= 0:
            taken[0] |= 1 << assigned[0, i]
    for i in range(first[0], first[1] if with_palm else first[0]):
        square, k = _nearest(places[0, i], local, taken[0])
        energy = 0.5 * precision[i] * square
        if k >= 0 and energy < missing:
            assigned[0, i], taken[0] = k, taken[0] | (1 << k)
        energies[0] += min(energy, missing)
    for f in range(5):
        begin, end = first[f + 1], first[f + 2]
        if begin == end or not free[f]:
            continue
        total = _COMBINATIONS * (_CHOICES + 1)
        next_assigned, next_energies = np.full((total, M), -1, np.int64), np.full(total, np.inf)
        next_postures, next_taken, made = np.zeros((total, 5), np.int64), np.zeros(total, np.int64), 0
        for c in range(count):
            choice, cost = np.full((_CHOICES, end - begin), -1, np.int64), np.full(_CHOICES, np.inf)
            posture = np.zeros(_CHOICES, np.int64)
            _choose(local, begin, end, places, prior[f], precision, missing, taken[c], choice, cost, posture)
            for q in range(_CHOICES):
                if cost[q] == np.inf:
                    continue
                next_assigned[made] = assigned[c]
                next_assigned[made, begin:end] = choice[q]
                next_energies[made] = energies[c] + cost[q]
                next_postures[made] = postures[c]
                next_postures[made, f] = posture[q]
                bits = taken[c]
                for k in choice[q]:
                    if k >= 0:
                        bits |= 1 << k
                next_taken[made] = bits
                made += 1
        order = np.argsort(next_energies[:made])
        count = min(made, _COMBINATIONS)
        for c in range(count):
            n = order[c]
            assigned[c], energies[c] = next_assigned[n], next_energies[n]
            postures[c], taken[c] = next_postures[n], next_taken[n]
    return assigned[:count].copy(), energies[:count].copy(), postures[:count].copy()


@compiled(nogil=True)
def _choose(
    local: Array,
    begin: int,
    end: int,
    places: Array,
    prior: Array,
    precision: Array,
    missing: float,
    taken: int,
    choice: Index,
    cost: Array,
    posture: Index,
) -> None:
    """Write the best different choices of points of one finger, their energies and postures."""
    mine = np.empty(end - begin, np.int64)
    for p in range(places.shape[0]):
        energy, bits = prior[p], taken
        for i in range(begin, end):
            square, k = _nearest(places[p, i], local, bits)
            e = 0.5 * precision[i] * square
            mine[i - begin] = -1
            if k >= 0 and e < missing:
                mine[i - begin] = k
                bits |= 1 << k
            energy += min(e, missing)
        worst, same = 0, -1
        for q in range(cost.shape[0]):
            if cost[q] > cost[worst]:
                worst = q
            if cost[q] < np.inf and np.all(choice[q] == mine):
                same = q
        slot = same if same >= 0 else worst
        if energy < cost[slot]:
            choice[slot], cost[slot], posture[slot] = mine, energy, p
