"""Rigid bodies by their exact distances: patterns of three and more markers.

Markers may be missing, as long as three have points.
"""

from itertools import combinations

import numpy as np

from depthtrack.geometry.alignment import rigid_alignment
from depthtrack.geometry.rotations import quaternion_from_matrix
from depthtrack.hand.pose import make_pose
from depthtrack.hand.size_parameters import COUNT
from depthtrack.markers.initialisation.assignment import assign_within
from depthtrack.markers.initialisation.hypotheses import Hypothesis, unique
from depthtrack.markers.initialisation.options import SearchOptions
from depthtrack.markers.initialisation.palms import match_triples
from depthtrack.markers.models.sized_fit import SizedFitter
from depthtrack.types import Array

_MOST_MATCHES = 50_000
_TRIPLES = 20
_ROUNDS = 4


def body_hypotheses(fitter: SizedFitter, points: Array, options: SearchOptions) -> list[Hypothesis]:
    """Return different assignments of a rigid body, the most probable first.

    There is none for fewer than three markers.

    points: (K, 3) metres. A symmetric pattern has several assignments of the same energy.
    """
    offsets = np.array(fitter.model.offsets)
    if len(offsets) < 3 or len(points) < 3:
        return []
    triples = np.array(list(combinations(range(len(offsets)), 3)))
    corners = offsets[triples]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=-1)
    found = np.empty((_MOST_MATCHES, 3, 4))
    deviation = 1 / np.sqrt(fitter.weights)
    best = triples[np.argsort(-area, kind="stable")[:_TRIPLES]]
    count = match_triples(offsets, best, deviation, points, found)
    placed = np.einsum("pij,mj->pmi", found[:count, :, :3], offsets) + found[:count, None, :, 3]
    scores = np.array([_score(fitter, places, points, options.missing) for places in placed])
    order = np.argsort(scores, kind="stable")[: 4 * options.hypotheses]
    matched = (_fitted(fitter, placed[k], points, options.missing) for k in order)
    return sorted(unique(h for h in matched if h is not None), key=lambda h: h.energy)


def _score(fitter: SizedFitter, places: Array, points: Array, missing: float) -> float:
    square = np.square(places[:, None] - points).sum(axis=-1).min(axis=1)
    return float(np.minimum(0.5 * fitter.weights * square, missing).sum())


def _fitted(fitter: SizedFitter, places: Array, points: Array, missing: float) -> Hypothesis | None:
    """Return what alternating assignment and alignment reach; None below three points."""
    model, assigned = fitter.model, np.full(len(places), -1)
    for _ in range(_ROUNDS):
        square = np.square(places[:, None] - points).sum(axis=-1)
        changed = assign_within(0.5 * fitter.weights[:, None] * square, missing)
        seen = changed >= 0
        if seen.sum() < 3:
            return None
        if np.array_equal(changed, assigned):
            break
        assigned = changed
        R, t = rigid_alignment(model.offsets[seen], points[assigned[seen]], fitter.weights[seen])
        places = model.offsets @ R.T + t
    seen = assigned >= 0
    square = np.square(places[seen] - points[assigned[seen]]).sum(axis=-1)
    energy = 0.5 * float(fitter.weights[seen] @ square) + missing * int((~seen).sum())
    return Hypothesis(assigned, energy, make_pose(t, quaternion_from_matrix(R), np.zeros(20)), np.zeros(COUNT))
