"""The search for a hand: palms, the fingers on each, fits of unknown sizes, neighbours."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from depthtrack.geometry.rotations import quaternion_from_matrix
from depthtrack.hand.limits import within_limits
from depthtrack.hand.pose import make_pose
from depthtrack.hand.size_parameters import COUNT
from depthtrack.markers.initialisation.assignment import assign_within
from depthtrack.markers.initialisation.finger_tables import FingerTables, points_near
from depthtrack.markers.initialisation.hypotheses import Hypothesis, unique
from depthtrack.markers.initialisation.neighbours import neighbours
from depthtrack.markers.initialisation.options import SearchOptions
from depthtrack.markers.initialisation.palms import palms_of_postures, palms_of_triples
from depthtrack.markers.models.sized_fit import SizedFitter
from depthtrack.types import Array, Index

_SAME_PALM = 0.02
"""Palms are one if their corners differ by less, root mean square, metres."""
_CORNERS = 0.05 * np.array([[1, 1, 0], [-1, 1, 0], [0, -1, 1], [0, -1, -1]])
_PALMS_COMPARED = 800
_PER_PALM = 4
"""Assignments kept for each palm."""
_ROUNDS = 6
_WIDENINGS = (0.010, 0.006, 0.003)
"""Standard deviation that the rounds of assignment add, metres; the last one stays."""
_FEWEST_POINTS = 3


@dataclass(frozen=True, eq=False)
class HandSearch:
    """A search for a hand in points (K, 3), metres."""

    fitter: SizedFitter
    options: SearchOptions

    @cached_property
    def tables(self) -> FingerTables:
        """The postures of the fingers."""
        return FingerTables.of(self.fitter, self.options.coarse, self.options.missing / 2)

    def hypotheses(self, points: Array) -> list[Hypothesis]:
        """Return different assignments, the most probable first."""
        starts = self._starts(self._palms(points), points)
        found = unique(self.refined(pose, assigned, points) for pose, assigned in starts)
        return self._with_neighbours(found, points)

    def _palms(self, points: Array) -> Array:
        """Return the palms T (P, 3, 4) with the best scores, different from each other."""
        deviation = 1 / np.sqrt(self.tables.precision[np.argsort(self.tables.markers)])
        model = self.fitter.model
        triples = palms_of_triples(model, deviation, points)
        palms = np.concatenate([triples, palms_of_postures(model, points, self.options.rotations)])
        corners = np.einsum("pij,cj->pci", palms[:, :, :3], _CORNERS) + palms[:, None, :, 3]
        kept: list[int] = []
        for k in self.tables.best(palms, points, _PALMS_COMPARED):
            distances = np.square(corners[kept] - corners[k]).sum(axis=-1).mean(axis=-1)
            if not len(kept) or distances.min() > _SAME_PALM**2:
                kept.append(int(k))
            if len(kept) == self.options.palms:
                break
        return palms[kept]

    def _starts(self, palms: Array, points: Array) -> list[tuple[Array, Index]]:
        """Return the poses (27,) and assignments (M,) of the best fingers on all palms."""
        best: dict[bytes, tuple[float, Array, Index]] = {}
        for palm in palms:
            near = points_near(palm, points)
            assigned, energies, angles = self.tables.combinations(palm, points[near])
            for row, energy, posture in zip(assigned[:_PER_PALM], energies, angles, strict=False):
                mine = np.where(row >= 0, near[row], -1)
                key = mine.tobytes()
                if (mine >= 0).sum() >= _FEWEST_POINTS and (key not in best or energy < best[key][0]):
                    pose = make_pose(palm[:, 3], quaternion_from_matrix(palm[:, :3]), posture)
                    best[key] = float(energy), within_limits(pose), mine
        ordered = sorted(best.values(), key=lambda start: start[0])
        return [(pose, assigned) for _, pose, assigned in ordered[: self.options.hypotheses]]

    def refined(self, pose: Array, assigned: Index, points: Array, rounds: int = _ROUNDS) -> Hypothesis:
        """Return the hypothesis that alternating fits and assignments reach."""
        pose, sizes = pose.copy(), np.zeros(COUNT)
        energy, predicted = self.fitter.fit(pose, sizes, points, assigned)
        for k in range(rounds):
            variance = 1 / self.fitter.weights + _WIDENINGS[min(k, len(_WIDENINGS) - 1)] ** 2
            square = np.square(predicted[:, None] - points).sum(axis=-1)
            changed = assign_within(0.5 * square / variance[:, None], self.options.missing)
            settled = np.array_equal(changed, assigned) and k >= len(_WIDENINGS) - 1
            if settled or (changed >= 0).sum() < _FEWEST_POINTS:
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

    def _with_neighbours(self, found: list[Hypothesis], points: Array) -> list[Hypothesis]:
        """Return the hypotheses and the neighbours of the best ones, sorted by energy.

        The search goes on from the best that has not been expanded, while it is near the best of all.
        """
        known, waiting = {h.key: h for h in found}, {h.key: h for h in found}
        for n in range(self.options.expansions):
            if not waiting:
                break
            best = min(waiting.values(), key=lambda h: h.energy)
            least = min(h.energy for h in known.values())
            if n >= self.options.least_expansions and best.energy > least + self.options.promising:
                break
            del waiting[best.key]
            for assigned in neighbours(best, points, self.fitter, self.tables, self.options.missing):
                if assigned.tobytes() not in known:
                    h = self.with_assignment(best, assigned, points)
                    known[h.key] = waiting[h.key] = h
        return sorted(known.values(), key=lambda h: h.energy)
