"""Candidates of a tracker: poses with their energy and agreement."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from depthtrack.rendering.scorer import Scorer
from depthtrack.types import Array


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
    rows = zip(poses, scores.energy.tolist(), scores.agreement.tolist(), strict=True)
    return by_energy(Candidate(pose, energy, agreement) for pose, energy, agreement in rows)


def by_energy(candidates: Iterable[Candidate]) -> list[Candidate]:
    """Return candidates by increasing energy; equal ones keep their order."""
    return sorted(candidates, key=lambda candidate: candidate.energy)


def poses_of(candidates: Iterable[Candidate]) -> Array:
    """Return the poses (N, 27) of candidates."""
    return np.stack([candidate.pose for candidate in candidates])
