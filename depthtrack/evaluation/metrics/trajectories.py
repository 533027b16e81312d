"""Metrics of trajectories that were linked without models, so that their names mean nothing.

The truth is a labelled capture of the same points. The counts are those of multiple object tracking (Bernardin and
Stiefelhagen, "Evaluating multiple object tracking performance: the CLEAR MOT metrics", 2008).
"""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from depthtrack.evaluation.metrics.markers import matching_samples
from depthtrack.types import Array, Index


@dataclass(frozen=True)
class TrajectoryScore:
    """Trajectories compared with labelled ones.

    samples: number of true samples.
    trajectories: number of trajectories that hold any of them.
    stretches: number of stretches of the true markers without a gap: the fewest possible trajectories without a bridge.
    recall: share of the true samples that are in a trajectory.
    purity: share of these whose marker is the most frequent one of the trajectory.
    switches: changes of the marker within a trajectory.
    mixed: number of trajectories of several markers.
    fragments: mean number of trajectories whose most frequent marker is the same one.
    """

    samples: int
    trajectories: int
    stretches: int
    recall: float | None
    purity: float | None
    switches: int
    mixed: int
    fragments: float | None

    def to_json(self) -> dict[str, Any]:
        """Return the scores as JSON values."""
        return asdict(self)


def trajectory_score(given: Array, true: Array) -> TrajectoryScore:
    """Return the score of trajectories.

    given, true: (T, N, 3) and (T, M, 3) metres; NaN without a sample.
    """
    found = matching_samples(given, true)
    present = np.asarray(np.isfinite(true).all(axis=-1))
    samples, matched = int(present.sum()), int((found >= 0).sum())
    counts = _counts(found, true.shape[1])
    used = counts.sum(axis=1) > 0
    owners = np.unique(counts[used].argmax(axis=1), return_counts=True)[1]
    starts = present & ~np.concatenate([np.zeros((1, present.shape[1]), dtype=np.bool_), present[:-1]])
    return TrajectoryScore(
        samples,
        int(used.sum()),
        int(starts.sum()),
        matched / samples if samples else None,
        float(counts.max(axis=1, initial=0).sum()) / matched if matched else None,
        sum(_switches(column) for column in found.T),
        int(((counts > 0).sum(axis=1) > 1).sum()),
        float(owners.mean()) if len(owners) else None,
    )


def _counts(found: Index, markers: int) -> Index:
    """Return how many samples of each marker each trajectory has (N, M)."""
    counts = np.zeros((found.shape[1], markers), dtype=np.int64)
    frames, columns = np.nonzero(found >= 0)
    np.add.at(counts, (columns, found[frames, columns]), 1)
    return counts


def _switches(column: Index) -> int:
    """Return how often the marker of a trajectory changes from one of its samples to the next."""
    markers = column[column >= 0]
    return int((np.diff(markers) != 0).sum())
