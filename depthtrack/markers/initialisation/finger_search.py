"""The compiled search for the points of each finger on a given palm, see `finger_tables`.

Points are in the frame of the palm, and a set of points is a word with a bit for each.
"""

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.types import Array, Index, Mask

_CHOICES = 6
"""Choices of points kept for each finger."""
_COMBINATIONS = 24
"""Combinations of fingers kept."""


@compiled(nogil=True)
def to_palm(T: Array, points: Array, out: Array) -> None:
    """Write points (K, 3), capture frame, in the frame of the palm T (3, 4) to `out` (K, 3)."""
    for k in range(points.shape[0]):
        d0, d1, d2 = points[k, 0] - T[0, 3], points[k, 1] - T[1, 3], points[k, 2] - T[2, 3]
        for j in range(3):
            out[k, j] = T[0, j] * d0 + T[1, j] * d1 + T[2, j] * d2


@compiled(nogil=True)
def _nearest(place: Array, points: Array, taken: int) -> tuple[float, int]:
    """Return squared distance and index of the nearest point that is not in `taken`."""
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
        to_palm(palms[n], points, local)
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
    """Return assignments (C, M), energies (C,) and postures (C, 5), see `FingerTables`.

    kept: (M,) points of what is not `free` (5,) fingers, nor the palm if `with_palm`.
    """
    M = places.shape[1]
    local = np.empty_like(points)
    to_palm(palm, points, local)
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
    """Write the best different choices of points of one finger, energies and postures."""
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
