"""Comparison of filling methods on stretches that are cut out of visible markers."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from depthtrack.errors import InputError
from depthtrack.hand.kinematics import body_of
from depthtrack.markers.filled_capture import Gap
from depthtrack.markers.filling.fill import fill_gaps
from depthtrack.markers.filling.options import FillMethod, FillOptions
from depthtrack.markers.filling.pca_fill import mean_distances
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.markers.labelled_fit import fit_poses
from depthtrack.types import Array, Index, Mask

_MARGIN = 5
"""Visible frames on both sides of a stretch."""
_APART = 0.3
"""Time between stretches of different markers, seconds."""
TIPS = np.array([body_of(finger, 2) for finger in range(5)])
"""Bodies of the fingertips."""


@dataclass(frozen=True)
class FillScore:
    """Errors of a method over all samples cut, metres.

    median, rms: distances from the cut positions.
    expected: root mean square of the errors that the method expects.
    filled: share of the cut samples that it fills.
    samples: number of cut samples.
    """

    method: FillMethod
    where: str
    median: float
    rms: float
    expected: float
    filled: float
    samples: int

    def row(self) -> dict[str, Any]:
        """Return JSON values, lengths in millimetres."""
        lengths = {"median_mm": self.median, "rms_mm": self.rms, "expected_mm": self.expected}
        return {
            "method": self.method,
            "markers": self.where,
            "samples": self.samples,
            "filled": self.filled,
            **{name: 1000 * value if np.isfinite(value) else None for name, value in lengths.items()},
        }


def compare_filling(
    captures: Sequence[LabelledCapture],
    shortest: int,
    longest: int,
    seeds: Sequence[int],
    methods: Sequence[FillMethod],
    together: int = 1,
    progress: Callable[[str, float], None] = lambda step, share: None,
) -> list[FillScore]:
    """Return the scores of each method over the stretches of all captures and seeds.

    shortest, longest: frames of a stretch.
    together: neighbouring markers that are cut at about the same time.
    progress: called with the current step and the share of the work that is done.

    Raises:
        InputError: if the lengths are out of order, or no stretch fits a capture.
    """
    scores: dict[tuple[FillMethod, str], list[FillScore]] = {}
    rounds = [(whole, seed) for whole in captures for seed in seeds]
    for number, (whole, seed) in enumerate(rounds):
        progress("fitting poses", number / len(rounds))
        cut, gaps = cut_stretches(whole, shortest, longest, seed, together)
        for k, method in enumerate(methods):
            progress(method, (number + (k + 1) / (len(methods) + 1)) / len(rounds))
            options = FillOptions(method=method, longest=longest / whole.capture.rate)
            for score in score_filling(whole, cut, gaps, options):
                scores.setdefault((method, score.where), []).append(score)
    return [pooled(each) for each in scores.values()]


def cut_stretches(
    labelled: LabelledCapture, shortest: int, longest: int, seed: int, together: int = 1
) -> tuple[LabelledCapture, tuple[Gap, ...]]:
    """Cut stretches out of visible markers, one after another; return capture and stretches.

    shortest, longest: frames of a stretch.
    together: a marker and its nearest neighbours on its model, this many, lose stretches that overlap.

    All poses are fitted again, without what was cut.
    Raises InputError if the lengths are out of order, or no stretch fits.
    """
    if not 1 <= shortest <= longest:
        raise InputError(f"stretches must be from 1 frame up, the shorter length first, found {shortest} to {longest}")
    if together < 1:
        raise InputError(f"at least 1 marker must be cut, found {together}")
    generator = np.random.default_rng(seed)
    visible = [columns >= 0 for columns in labelled.columns]
    distances = [mean_distances(labelled.positions(k)) for k in range(len(visible))]
    owners = [(k, m) for k, seen in enumerate(visible) for m in range(seen.shape[1])]
    apart = max(round(_APART * labelled.capture.rate), 2 * _MARGIN)
    gaps, t = [], apart
    while t + longest + apart <= len(labelled.capture):
        length = int(generator.integers(shortest, longest + 1))
        rows = slice(t - _MARGIN, t + length + _MARGIN)
        usable = [(k, m) for k, m in owners if visible[k][rows, m].all()]
        if usable:
            k, m = usable[int(generator.integers(len(usable)))]
            gaps.append(Gap(k, m, t, t + length))
            near = sorted((other for j, other in usable if j == k and other != m), key=lambda o: distances[k][m, o])
            for other in near[: together - 1]:
                mine = int(generator.integers(min(shortest, length), length + 1))
                first = t + int(generator.integers(length - mine + 1))
                gaps.append(Gap(k, other, first, first + mine))
        t += length + apart
    if not gaps:
        raise InputError(f"no marker is visible for {shortest} frames: cut shorter stretches")
    return _without(labelled, gaps), tuple(gaps)


def _without(labelled: LabelledCapture, gaps: Sequence[Gap]) -> LabelledCapture:
    columns = [np.array(each) for each in labelled.columns]
    for gap in gaps:
        columns[gap.model][gap.start : gap.stop, gap.marker] = -1
    return fit_poses(replace(labelled, columns=tuple(columns)))


def score_filling(
    whole: LabelledCapture, cut: LabelledCapture, gaps: Sequence[Gap], options: FillOptions,
    truth: Sequence[Array] | None = None,
) -> list[FillScore]:  # fmt: skip
    """Return the scores of a method over all stretches, and over those of fingertips.

    truth: (T, M, 3) positions of each model's markers, metres; those measured if None.
    """
    filled = fill_gaps(cut, options)
    true = [whole.positions(k) for k in range(len(whole.models))] if truth is None else truth
    errors, expected, tips = (np.concatenate(parts) for parts in zip(*(
        (
            np.linalg.norm((filled.positions[k] - true[k])[start:stop, m], axis=-1),
            filled.expected_error[k][start:stop, m],
            np.full(stop - start, not whole.models[k].is_rigid and whole.models[k].bodies[m] in TIPS),
        )
        for k, m, start, stop in gaps
    ), strict=True))  # fmt: skip
    places: list[tuple[str, Mask]] = [("all", np.ones(len(errors), dtype=np.bool_)), ("fingertips", tips)]
    return [_score(options.method, where, errors[mask], expected[mask]) for where, mask in places if mask.any()]


def _score(method: FillMethod, where: str, errors: Array, expected: Array) -> FillScore:
    done = np.isfinite(errors)
    median, rms = (float(np.median(errors[done])), _rms(errors[done])) if done.any() else (np.nan, np.nan)
    return FillScore(method, where, median, rms, _rms(expected[done]), float(done.mean()), len(errors))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else float("nan")


def pooled(scores: Sequence[FillScore]) -> FillScore:
    """Return the score of several captures or seeds: means weighted by the number of samples."""
    weights = np.array([score.samples for score in scores], dtype=np.float64)
    weights /= weights.sum()

    def of(values: Index | Array | list[float]) -> float:
        return float(weights @ np.asarray(values, dtype=np.float64))

    return replace(
        scores[0],
        median=of([score.median for score in scores]),
        rms=float(np.sqrt(of([score.rms**2 for score in scores]))),
        expected=float(np.sqrt(of([score.expected**2 for score in scores]))),
        filled=of([score.filled for score in scores]),
        samples=sum(score.samples for score in scores),
    )
