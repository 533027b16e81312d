"""Assignments of one model to points, from coarse to fine, the most probable first."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations

import numpy as np
from scipy.optimize import linear_sum_assignment

from depthtrack.geometry.rotations import quaternion_from_matrix
from depthtrack.hand.limits import within_limits
from depthtrack.hand.pose import make_pose
from depthtrack.hand.size_parameters import COUNT
from depthtrack.markers.initialisation.assignment import PADDING, assign_within
from depthtrack.markers.initialisation.fingers import FingerTables
from depthtrack.markers.initialisation.options import SearchOptions
from depthtrack.markers.initialisation.palms import palms_of_postures, palms_of_triples
from depthtrack.markers.models.sized_fit import SizedFitter
from depthtrack.types import Array, Index

_MOST_POINTS = 62
"""Points near a palm that its fingers are searched among; a bit of a word each."""
_REACH = 0.25
"""Largest distance of a marker from the centre of the palm, metres."""
_SAME_PALM = 0.02
"""Palms are one if their corners differ by less, root mean square, metres."""
_CORNERS = 0.05 * np.array([[1, 1, 0], [-1, 1, 0], [0, -1, 1], [0, -1, -1]])
_ROUNDS = 6
_WIDENINGS = (0.010, 0.006, 0.003)
"""Standard deviation added to the markers in the first rounds of assignment, metres; the last one stays."""
_PALMS_KEPT = 800
_PER_PALM = 4
_LOCAL_ROUNDS = 12
"""Most hypotheses whose neighbours are fitted."""
_LEAST_EXPANDED, _PROMISING = 2, 4.0
"""Fewest such hypotheses, and the energy above the best at which others are no longer promising."""
_PER_RELEASE = 5
_MOST_SHIFTS = 24
_SHIFT = 0.010
"""Standard deviation that a shift of points along neighbouring markers adds, metres."""


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A model with assigned points.

    points: (M,) point of each marker, -1 for none.
    energy: of the fit, and of the markers without a point.
    """

    points: Index
    energy: float
    pose: Array
    sizes: Array

    def renumbered(self, numbers: Index) -> "Hypothesis":
        """Return the hypothesis with point k called `numbers[k]`."""
        return replace(self, points=np.where(self.points >= 0, numbers[self.points], -1))

    @property
    def key(self) -> bytes:
        """The assignment as a dictionary key."""
        return self.points.tobytes()


@dataclass(frozen=True, eq=False)
class HandSearch:
    """A search for a hand in points (K, 3), metres."""

    fitter: SizedFitter
    tables: FingerTables
    options: SearchOptions

    @staticmethod
    def of(fitter: SizedFitter, options: SearchOptions) -> "HandSearch":
        """Return the search for the hand of a fitter."""
        return HandSearch(fitter, FingerTables.of(fitter, options.coarse, options.missing / 2), options)

    def hypotheses(self, points: Array) -> list[Hypothesis]:
        """Return different assignments, the most probable first."""
        palms = self._palms(points)
        coarse: dict[bytes, tuple[float, Array, Index]] = {}
        for palm in palms:
            near = _near(palm, points)
            assigned, energies, angles = self.tables.combinations(palm, points[near])
            for a, e, x in zip(assigned[:_PER_PALM], energies, angles, strict=False):
                a = np.where(a >= 0, near[a], -1)
                if (a >= 0).sum() >= 3 and not (a.tobytes() in coarse and coarse[a.tobytes()][0] <= e):
                    coarse[a.tobytes()] = float(e), make_pose(palm[:, 3], quaternion_from_matrix(palm[:, :3]), x), a
        best = sorted(coarse.values(), key=lambda row: row[0])[: self.options.hypotheses]
        fine = unique(self.refined(within_limits(pose), assigned, points) for _, pose, assigned in best)
        return self._searched_locally(fine, points)

    @cached_property
    def finger(self) -> Index:
        """The finger (M,) of each marker, -1 for the palm."""
        bodies = np.asarray(self.fitter.model.bodies)
        return np.where(bodies == 0, -1, (bodies - 1) // 3)

    def _palms(self, points: Array) -> Array:
        """Return the palms with the best scores, different from each other."""
        deviation = 1 / np.sqrt(self.tables.precision[np.argsort(self.tables.markers)])
        model = self.fitter.model
        palms = np.concatenate(
            [
                palms_of_triples(model, deviation, points),
                palms_of_postures(model, points, self.options.rotations),
            ]
        )
        corners = np.einsum("pij,cj->pci", palms[:, :, :3], _CORNERS) + palms[:, None, :, 3]
        kept: list[int] = []
        for k in self.tables.best(palms, points, _PALMS_KEPT):
            distances = np.square(corners[kept] - corners[k]).sum(axis=-1).mean(axis=-1)
            if not len(kept) or distances.min() > _SAME_PALM**2:
                kept.append(int(k))
            if len(kept) == self.options.palms:
                break
        return palms[kept]

    def refined(self, pose: Array, assigned: Index, points: Array, rounds: int = _ROUNDS) -> Hypothesis:
        """Return the hypothesis that alternating fits and assignments reach."""
        pose, sizes, missing = pose.copy(), np.zeros(COUNT), self.options.missing
        energy, predicted = self.fitter.fit(pose, sizes, points, assigned)
        for k in range(rounds):
            variance = 1 / self.fitter.weights + _WIDENINGS[min(k, len(_WIDENINGS) - 1)] ** 2
            square = np.square(predicted[:, None] - points).sum(axis=-1)
            changed = assign_within(0.5 * square / variance[:, None], missing)
            if np.array_equal(changed, assigned) and k >= len(_WIDENINGS) - 1:
                break
            if (changed >= 0).sum() < 3:
                break
            assigned = changed
            energy, predicted = self.fitter.fit(pose, sizes, points, assigned)
        return self._hypothesis(pose, sizes, energy, assigned)

    def with_assignment(self, start: Hypothesis, assigned: Index, points: Array) -> Hypothesis:
        """Return the fit of another assignment, from the pose of a hypothesis."""
        pose, sizes = start.pose.copy(), start.sizes.copy()
        energy, _ = self.fitter.fit(pose, sizes, points, assigned)
        return self._hypothesis(pose, sizes, energy, assigned)

    def _hypothesis(self, pose: Array, sizes: Array, energy: float, assigned: Index) -> Hypothesis:
        return Hypothesis(assigned, energy + self.options.missing * int((assigned < 0).sum()), pose, sizes)

    def _searched_locally(self, found: list[Hypothesis], points: Array) -> list[Hypothesis]:
        """Return the hypotheses and the neighbours of the best: descent until the best has no better neighbour."""
        known = {h.key: h for h in found}
        if not known:
            return []
        expanded: set[bytes] = set()
        for _ in range(_LOCAL_ROUNDS):
            best = min((h for h in known.values() if h.key not in expanded), key=lambda h: h.energy)
            if len(expanded) >= _LEAST_EXPANDED and best.energy > min(h.energy for h in known.values()) + _PROMISING:
                break
            expanded.add(best.key)
            for assigned in self._neighbours(best, points):
                if assigned.tobytes() not in known:
                    known[assigned.tobytes()] = self.with_assignment(best, assigned, points)
        return sorted(known.values(), key=lambda h: h.energy)

    def _with_fingers_released(self, h: Hypothesis, points: Array) -> Iterator[Index]:
        """Yield assignments in which two fingers choose their points again."""
        T = self.fitter.model.kinematics.transforms(h.pose)[0, :3]
        near = _near(T, points)
        number = np.full(len(points) + 1, -1)
        number[near] = np.arange(len(near))
        kept = number[h.points]
        for fingers in combinations(range(5), 2):
            assigned, _, _ = self.tables.with_fingers_released(T, points[near], kept, fingers)
            for a in assigned[:_PER_RELEASE]:
                yield np.where(a >= 0, near[a], -1)

    def _neighbours(self, h: Hypothesis, points: Array) -> Iterator[Index]:
        """Yield assignments with two fingers chosen again, or markers of the palm or free points exchanged."""
        yield from self._with_fingers_released(h, points)
        members = [np.flatnonzero(self.finger == f).tolist() for f in range(-1, 5)]
        for mine in members:
            yield from (_exchanged(h.points, [a], [b]) for a, b in combinations(mine, 2))
        for mine, other in combinations(members[1:], 2):
            if len(mine) == len(other):
                yield _exchanged(h.points, mine, other)
        predicted = self.fitter.fitted_model(h.sizes).positions(h.pose)
        yield from self._with_shifted_gap(h, predicted, points)
        free = np.setdiff1d(np.arange(len(points)), h.points)
        for i in range(len(predicted)):
            if h.points[i] >= 0:
                yield _replaced(h.points, i, -1)
            if len(free):
                near = free[np.argmin(np.square(points[free] - predicted[i]).sum(axis=-1))]
                yield _replaced(h.points, i, int(near))

    def _with_shifted_gap(self, h: Hypothesis, predicted: Array, points: Array) -> Iterator[Index]:
        """Yield optimal assignments in which a marker without a point has one, and another has none instead.

        They move the points of several markers by one, as along the knuckles.
        """
        markers, count = len(predicted), len(points)
        variance = 1 / self.fitter.weights + _SHIFT**2
        cost = np.full((markers, count + markers), self.options.missing)
        cost[:, :count] = 0.5 * np.square(predicted[:, None] - points).sum(axis=-1) / variance[:, None]
        found: dict[bytes, tuple[float, Index]] = {}
        for gap in np.flatnonzero(h.points < 0):
            for other in np.flatnonzero(h.points >= 0):
                forced = cost.copy()
                forced[gap, count:] = forced[other, :count] = PADDING
                rows, chosen = linear_sum_assignment(forced)
                assigned = np.where(chosen < count, chosen, -1)
                found[assigned.tobytes()] = float(forced[rows, chosen].sum()), assigned
        yield from (assigned for _, assigned in sorted(found.values(), key=lambda row: row[0])[:_MOST_SHIFTS])


def _near(palm: Array, points: Array) -> Index:
    """Return the points within reach of a palm, the nearest ones if they are many."""
    distance = np.linalg.norm(points - palm[:, 3], axis=-1)
    order = np.argsort(distance, kind="stable")[:_MOST_POINTS]
    return order[distance[order] < _REACH].astype(np.int64)


def unique(found: Iterable[Hypothesis]) -> list[Hypothesis]:
    """Return the best hypothesis of each assignment."""
    best: dict[bytes, Hypothesis] = {}
    for h in found:
        if h.key not in best or h.energy < best[h.key].energy:
            best[h.key] = h
    return list(best.values())


def _exchanged(points: Index, a: Iterable[int], b: Iterable[int]) -> Index:
    out, a, b = points.copy(), list(a), list(b)
    out[a], out[b] = points[b], points[a]
    return out


def _replaced(points: Index, i: int, k: int) -> Index:
    out = points.copy()
    out[i] = k
    return out
