"""Fingers on a palm: with a palm given, each finger takes its points by itself.

A table holds postures of each finger, with the markers they place. A palm is scored by the best posture of each finger.
The best choices of points of the five fingers are then combined such that no point is taken twice.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from depthtrack.hand.compiled_kinematics import BodyPoses
from depthtrack.hand.limits import LOWER, UPPER
from depthtrack.hand.pose import make_pose
from depthtrack.hand.size_parameters import COUNT
from depthtrack.markers.initialisation.finger_search import combine_fingers, score_palms
from depthtrack.markers.models.sized_fit import SizedFitter
from depthtrack.markers.models.sized_markers import COLUMNS, marker_jacobian, place_markers, set_sizes
from depthtrack.types import Array, Index, Mask

_DIP_SHARE = 2 / 3
"""Flexion of the last joint as a share of the one before it (Rijpkema and Girard 1991)."""
_MOST_POINTS = 62
"""Points near a palm that its fingers are searched among; a bit of a word each."""
_REACH = 0.25
"""Largest distance of a marker from the centre of the palm, metres."""
_STRIDE = 5
"""Every n-th posture scores all palms; no divisor of the steps of a grid, so that each angle takes all its values."""


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
        """Return the `count` best of palms T (P, 3, 4), that of the least energy first.

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
        """Return assignments (C, M) of points (K, 3), energies and angles (C, 20), sorted.

        K is at most 62.
        """
        return self._combined(palm, points, np.full(self.count, -1), np.ones(5, np.bool_), True)

    def with_fingers_released(
        self, palm: Array, points: Array, assigned: Index, fingers: tuple[int, ...]
    ) -> tuple[Index, Array, Array]:
        """Return `combinations` of some fingers; all else keeps its points `assigned` (M,)."""
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
    """Return the variance (M,) of each coordinate of the markers by the hand's sizes, m^2."""
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


def points_near(palm: Array, points: Array) -> Index:
    """Return the points within reach of a palm T (3, 4), the nearest ones if they are many."""
    distance = np.linalg.norm(points - palm[:, 3], axis=-1)
    order = np.argsort(distance, kind="stable")[:_MOST_POINTS]
    return order[distance[order] < _REACH].astype(np.int64)
