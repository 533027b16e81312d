"""Metrics of marker captures: labels of samples, positions of markers, angles of hands.

A sample is a measured point in one frame. Its true label is that of the true sample at the same position.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from depthtrack.evaluation.metrics.metric import Metric, Statistics
from depthtrack.hand.pose import ANGLES, FINGERS
from depthtrack.types import Array, Index, Mask

SAME_POSITION = 1e-5
"""Largest distance between equal positions, metres; files with 32-bit numbers round to a hundredth of it."""
_CHUNK = 256
"""Frames compared at once."""


class Mislabelling(NamedTuple):
    """Frames `first` to `last` in which a marker has a sample of something else.

    given: label of the marker.
    true: label of the sample; None if it is a ghost, or belongs to no model.
    """

    given: str
    true: str | None
    first: int
    last: int


@dataclass(frozen=True, eq=False)
class LabelScore:
    """Labels of samples compared with the true ones.

    labels: (M,) of the markers.
    right: (M,) samples with their true label.
    swapped: (M,) samples of other markers with this label.
    false: (M,) samples of no marker with this label.
    missed: (M,) samples of this marker without a label.
    rejected: number of other points that have no label, as is right.
    errors: all stretches of `swapped` and `false` samples, by time.
    """

    labels: tuple[str, ...]
    right: Index
    swapped: Index
    false: Index
    missed: Index
    rejected: int
    errors: tuple[Mislabelling, ...]

    @property
    def accuracy(self) -> float | None:
        """Share of all points that have the true label, or rightly none."""
        wrong = int(self.swapped.sum() + self.false.sum() + self.missed.sum())
        right = int(self.right.sum()) + self.rejected
        return _share(right, right + wrong)

    @property
    def precision(self) -> float | None:
        """Share of the labelled points that have the true label."""
        return _share(self.right.sum(), self.right.sum() + self.swapped.sum() + self.false.sum())

    @property
    def recall(self) -> float | None:
        """Share of the markers' samples that have the true label."""
        # A swapped sample is counted once, at the label that it was given.
        return _share(self.right.sum(), self.right.sum() + self.swapped.sum() + self.missed.sum())

    @property
    def f1(self) -> float | None:
        """Harmonic mean of precision and recall."""
        right = int(self.right.sum())
        wrong = int(2 * self.swapped.sum() + self.false.sum() + self.missed.sum())
        return _share(2 * right, 2 * right + wrong)

    def to_json(self) -> dict[str, Any]:
        """Return the scores and all errors as JSON values."""
        counts = {name: getattr(self, name) for name in ("right", "swapped", "false", "missed")}
        return {
            **{name: getattr(self, name) for name in ("accuracy", "precision", "recall", "f1")},
            **{name: int(values.sum()) for name, values in counts.items()},
            "rejected": self.rejected,
            "by_marker": {
                label: {name: int(values[m]) for name, values in counts.items()} for m, label in enumerate(self.labels)
            },
            "errors": [error._asdict() for error in self.errors],
        }


def label_score(
    labels: Sequence[str], given: Array, true: Array, true_labels: Sequence[str], expected: Index, points: int
) -> LabelScore:
    """Return the score of labels.

    labels: (M,) of the markers.
    given: (T, M, 3) samples that have these labels, metres; NaN without one.
    true: (T, N, 3) samples with true labels, metres; NaN without one.
    true_labels: (N,)
    expected: (M,) index of each marker among the true ones; -1 if it has no truth.
    points: number of points in the capture, labelled or not.
    """
    found = matching_samples(given, true)
    has = np.isfinite(given).all(axis=-1)
    # Whether a true marker is one of the models': others are points that need no label.
    named = np.zeros(len(true_labels) + 1, dtype=np.bool_)
    named[expected[expected >= 0]] = True
    right = has & (found == expected) & (expected >= 0)
    swapped = has & ~right & named[found]
    false = has & ~right & ~swapped
    labelled = np.zeros(true.shape[:2], dtype=np.bool_)
    frames, markers = np.nonzero(has & (found >= 0))
    labelled[frames, found[frames, markers]] = True
    missed = np.isfinite(true).all(axis=-1) & ~labelled
    lost = np.where(expected >= 0, missed[:, expected].sum(axis=0), 0)
    return LabelScore(
        tuple(labels),
        right.sum(axis=0),
        swapped.sum(axis=0),
        false.sum(axis=0),
        lost,
        points - int(has.sum()) - int(lost.sum()),
        tuple(sorted(_errors(labels, swapped | false, found, true_labels), key=lambda error: (error.first, error))),
    )


def matching_samples(given: Array, true: Array) -> Index:
    """Return the true sample (T, M) at the position of each given one; -1 if there is none.

    given, true: (T, M, 3) and (T, N, 3) metres; NaN without a sample.
    """
    found = np.full(given.shape[:2], -1, dtype=np.int64)
    if true.shape[1] == 0:
        return found
    for start in range(0, len(given), _CHUNK):
        part = slice(start, start + _CHUNK)
        square = ((given[part, :, None] - true[part, None]) ** 2).sum(axis=-1)
        square[np.isnan(square)] = np.inf
        nearest = square.argmin(axis=-1)
        near = np.take_along_axis(square, nearest[..., None], axis=-1)[..., 0] <= SAME_POSITION**2
        found[part] = np.where(near, nearest, -1)
    return found


def _errors(labels: Sequence[str], wrong: Mask, found: Index, true_labels: Sequence[str]) -> Iterator[Mislabelling]:
    """Yield the stretches of equal errors of each marker."""
    for m, label in enumerate(labels):
        code = np.where(wrong[:, m], found[:, m], -2)
        starts = np.flatnonzero(np.diff(code, prepend=-3))
        for first, stop in zip(starts, [*starts[1:], len(code)], strict=True):
            if code[first] != -2:
                true = true_labels[code[first]] if code[first] >= 0 else None
                yield Mislabelling(label, true, int(first), int(stop) - 1)


class FilledGap(NamedTuple):
    """Errors in the filled frames `first` to `last` of a marker, mm."""

    marker: str
    how: str
    first: int
    last: int
    median_mm: float
    max_mm: float


@dataclass(frozen=True, eq=False)
class PositionErrors:
    """Distances of markers from their true positions.

    labels: (M,) of the markers.
    mm: (T, M); NaN without a position or without truth.
    how: (T, M) word for how the position came about: `measured`, or the way of filling.
    expected_mm: (T, M) expected error of filled positions; NaN if none is stated.
    """

    labels: tuple[str, ...]
    mm: Array
    how: np.ndarray[Any, np.dtype[np.str_]]
    expected_mm: Array

    @property
    def filled(self) -> Mask:
        """Whether a position (T, M) is a filled one with truth."""
        return np.asarray((self.how != MEASURED) & np.isfinite(self.mm))

    def of(self, chosen: Mask) -> dict[str, float | int | None]:
        """Return number and statistics of some positions (T, M)."""
        values = self.mm[chosen & np.isfinite(self.mm)]
        return {"samples": len(values), **Metric("position_error_mm", "mm", values).statistics()}

    def gaps(self) -> Iterator[FilledGap]:
        """Yield the filled gaps whose truth is known, by marker and time."""
        for m, label in enumerate(self.labels):
            code = np.where(self.filled[:, m], self.how[:, m], "")
            starts = np.flatnonzero(np.concatenate([[True], code[1:] != code[:-1]]))
            for first, stop in zip(starts, [*starts[1:], len(code)], strict=True):
                if code[first]:
                    part = self.mm[first:stop, m]
                    yield FilledGap(
                        label, str(code[first]), int(first), int(stop) - 1, float(np.median(part)), float(part.max())
                    )

    def to_json(self) -> dict[str, Any]:
        """Return the statistics as JSON values, and all filled gaps."""
        filled, known = self.filled, self.filled & np.isfinite(self.expected_mm)
        ways = sorted(set(self.how[filled].tolist()))
        ratio = _rms(self.mm[known]) / _rms(self.expected_mm[known]) if self.expected_mm[known].any() else None
        return {
            "measured": self.of(self.how == MEASURED),
            "filled": self.of(filled),
            "by_way": {way: self.of(filled & (self.how == way)) for way in ways},
            "filled_by_marker": {
                label: self.of(filled & (np.arange(len(self.labels)) == m))
                for m, label in enumerate(self.labels)
                if filled[:, m].any()
            },
            "filled_error_over_expected": ratio,
            "gaps": [gap._asdict() for gap in self.gaps()],
        }


MEASURED = "measured"
"""Word of `PositionErrors.how` for positions that were measured."""


@dataclass(frozen=True, eq=False)
class AngleErrors:
    """Absolute differences of the finger angles of one hand from the true ones.

    degrees: (T, 20); NaN without a pose.
    seen: (T, 20) whether all markers of the finger were measured.
    """

    degrees: Array
    seen: Mask

    @classmethod
    def between(cls, poses: Array, true_poses: Array, measured: Mask, bodies: Index) -> "AngleErrors":
        """Return the differences between poses (T, 27).

        measured: (T, M) whether a marker was measured.
        bodies: (M,) body of each marker.
        """
        degrees = np.degrees(np.abs(poses[:, ANGLES] - true_poses[:, ANGLES]))
        finger = (bodies - 1) // 3
        whole = np.stack([measured[:, finger == f].all(axis=1) for f in range(len(FINGERS))], axis=1)
        return cls(degrees, np.repeat(whole, 4, axis=1))

    @property
    def mean(self) -> float | None:
        """Mean over frames and angles, degrees. Source: Maycock et al. 2015, Fig. 6."""
        return self._mean(np.ones_like(self.seen))

    def to_json(self) -> dict[str, Any]:
        """Return means over all frames, and over those with and without dropped markers.

        A finger has dropped markers if any of its markers was not measured.
        """
        per_frame: Statistics = Metric("angle_error_deg", "deg", self.degrees.mean(axis=1)).statistics()
        return {
            "frames": int(np.isfinite(self.degrees).all(axis=1).sum()),
            "angle_error_deg": per_frame,
            "seen_angle_error_deg": self._mean(self.seen),
            "dropped_angle_error_deg": self._mean(~self.seen),
        }

    def _mean(self, chosen: Mask) -> float | None:
        values = self.degrees[chosen & np.isfinite(self.degrees)]
        return float(values.mean()) if len(values) else None


def _share(part: Any, whole: Any) -> float | None:
    return float(part) / float(whole) if whole else None


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
