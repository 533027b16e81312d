"""Neighbours of an assignment: what a wrong start most often differs by."""

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np
from scipy.optimize import linear_sum_assignment

from depthtrack.markers.initialisation.assignment import PADDING
from depthtrack.markers.initialisation.finger_tables import FingerTables, points_near
from depthtrack.markers.initialisation.hypotheses import Hypothesis
from depthtrack.markers.models.sized_fit import SizedFitter
from depthtrack.types import Array, Index

_PER_PAIR = 5
"""Assignments kept for two fingers that choose again."""
_MOST_SHIFTS = 24
_SHIFT = 0.010
"""Standard deviation that a shift of points along neighbouring markers adds, metres."""


def neighbours(
    h: Hypothesis, points: Array, fitter: SizedFitter, tables: FingerTables, missing: float
) -> Iterator[Index]:
    """Yield assignments (M,) that differ from a hypothesis in a few markers.

    points: (K, 3) metres. missing: energy of a marker without a point.
    """
    predicted = fitter.fitted_model(h.sizes).positions(h.pose)
    yield from with_two_fingers_chosen_again(h, points, fitter, tables)
    yield from with_exchanges(h.points, np.asarray(fitter.model.bodies))
    yield from with_a_shifted_gap(h.points, predicted, points, fitter.weights, missing)
    yield from with_free_points(h.points, predicted, points)


def with_two_fingers_chosen_again(
    h: Hypothesis, points: Array, fitter: SizedFitter, tables: FingerTables
) -> Iterator[Index]:
    """Yield assignments in which two fingers choose among their points and the free ones."""
    palm = fitter.model.kinematics.transforms(h.pose)[0, :3]
    near = points_near(palm, points)
    number = np.full(len(points) + 1, -1)
    number[near] = np.arange(len(near))
    for fingers in combinations(range(5), 2):
        assigned, _, _ = tables.with_fingers_released(palm, points[near], number[h.points], fingers)
        for row in assigned[:_PER_PAIR]:
            yield np.where(row >= 0, near[row], -1)


def with_exchanges(assigned: Index, bodies: Index) -> Iterator[Index]:
    """Yield assignments with two markers of a finger or of the palm exchanged, or two fingers."""
    finger = np.where(bodies == 0, -1, (bodies - 1) // 3)
    members = [np.flatnonzero(finger == f).tolist() for f in range(-1, 5)]
    for mine in members:
        yield from (_exchanged(assigned, [a], [b]) for a, b in combinations(mine, 2))
    for mine, other in combinations(members[1:], 2):
        if len(mine) == len(other):
            yield _exchanged(assigned, mine, other)


def with_a_shifted_gap(
    assigned: Index, predicted: Array, points: Array, weights: Array, missing: float
) -> Iterator[Index]:
    """Yield the optimal assignments in which another marker than now has no point.

    They shift the points of several markers by one, as along the knuckles.
    """
    markers, count = len(predicted), len(points)
    cost = np.full((markers, count + markers), missing)
    square = np.square(predicted[:, None] - points).sum(axis=-1)
    cost[:, :count] = 0.5 * square / (1 / weights + _SHIFT**2)[:, None]
    found: dict[bytes, tuple[float, Index]] = {}
    for gap in np.flatnonzero(assigned < 0):
        for other in np.flatnonzero(assigned >= 0):
            forced = cost.copy()
            forced[gap, count:] = forced[other, :count] = PADDING
            rows, chosen = linear_sum_assignment(forced)
            total, shifted = float(forced[rows, chosen].sum()), np.where(chosen < count, chosen, -1)
            if total < PADDING:
                found[shifted.tobytes()] = total, shifted
    best = sorted(found.values(), key=lambda row: row[0])[:_MOST_SHIFTS]
    yield from (shifted for _, shifted in best)


def with_free_points(assigned: Index, predicted: Array, points: Array) -> Iterator[Index]:
    """Yield assignments with a marker that loses its point, or takes the nearest free one."""
    free = np.setdiff1d(np.arange(len(points)), assigned)
    for i, place in enumerate(predicted):
        if assigned[i] >= 0:
            yield _replaced(assigned, i, -1)
        if len(free):
            yield _replaced(assigned, i, int(free[np.argmin(np.square(points[free] - place).sum(axis=-1))]))


def _exchanged(assigned: Index, a: Sequence[int], b: Sequence[int]) -> Index:
    out = assigned.copy()
    out[list(a)], out[list(b)] = assigned[list(b)], assigned[list(a)]
    return out


def _replaced(assigned: Index, i: int, k: int) -> Index:
    out = assigned.copy()
    out[i] = k
    return out
