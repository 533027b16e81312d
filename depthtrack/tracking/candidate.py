"""Candidates of a tracker: poses with their energy and agreement."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from depthtrack.rendering.objective import Terms
from depthtrack.rendering.options import Objective
from depthtrack.rendering.scorer import Scorer
from depthtrack.rendering.seen_sums import seen_sums
from depthtrack.rendering.target import Target
from depthtrack.types import Array, Depth


class Candidate(NamedTuple):
    """Scored pose.

    pose: (27,) pose vector, camera frame.
    energy: E of Oikonomidis et al. 2011, Eq. (1).
    agreement: agreement of rendered and observed silhouette, 0 to 1 (1 minus the silhouette term of Eq. 2).
    """

    pose: Array
    energy: float
    agreement: float


def evaluate(scorer: Scorer, poses: Array) -> list[Candidate]:
    """Score poses (N, 27); return them by increasing energy."""
    scores = scorer.evaluate(poses)
    order = np.argsort(scores.energy, kind="stable")
    rows = zip(poses[order], scores.energy[order].tolist(), scores.agreement[order].tolist(), strict=True)
    return [Candidate(*row) for row in rows]


def seen_part(candidate: Candidate, rendered: Depth, target: Target, objective: Objective) -> Candidate:
    """Return the candidate with the energy and the agreement of what nothing hides of it.

    rendered: (h, w) depth of its pose, metres.
    """
    if target.hiding is None:
        return candidate
    occluder = np.zeros_like(target.hiding) if target.occluder is None else target.occluder
    limits = objective.match_depth, objective.clamp_depth, float(objective.before_cost), objective.hidden_depth
    sums = np.empty(3)
    hidden = seen_sums(rendered, target.silhouette, target.depth, target.hiding, occluder, limits, sums)
    if not hidden and target.occluder is None:
        return candidate
    terms = Terms.of_sums(objective, candidate.pose[None], *sums[:, None])
    return Candidate(candidate.pose, float(terms.energy[0]), float(terms.agreement[0]))


def by_energy(candidates: Iterable[Candidate]) -> list[Candidate]:
    """Return candidates by increasing energy; equal ones keep their order."""
    return sorted(candidates, key=lambda candidate: candidate.energy)


def poses_of(candidates: Iterable[Candidate]) -> Array:
    """Return the poses (N, 27) of candidates."""
    return np.stack([candidate.pose for candidate in candidates])
