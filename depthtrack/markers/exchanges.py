"""Exchange of two markers of a hand where it fits much better with their points exchanged.

Two fingertips that were hidden together may reappear exchanged. They stay so, since every later frame confirms the
labels of the one before, but the hand then fits worse than elsewhere. Frames of such a stretch are fitted with the
labels as they are and exchanged, each frame alone.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations

import numpy as np

from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.markers.labelled_fit import frame_poses
from depthtrack.markers.labelling.options import LabellingOptions, OfflineOptions
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.types import Array, Index, Mask

_SAMPLED = 20
"""Frames of a stretch that are fitted, at most."""
_SHORTEST = 5
"""Frames of a stretch, at least."""


def exchange_markers(labelled: LabelledCapture, options: LabellingOptions | None = None) -> LabelledCapture:
    """Return the capture with markers exchanged where that fits much better.

    Its poses stay those of the labels before.
    """
    chosen = options or LabellingOptions()
    columns = tuple(rows.copy() for rows in labelled.columns)
    confidence = tuple(rows.copy() for rows in labelled.confidence)
    changed = False
    for k, model in enumerate(labelled.models):
        if model.is_rigid:
            continue
        residuals, positions = labelled.residuals(k), labelled.positions(k)
        usual = np.array([_usual(each) for each in residuals.T])
        for i, j in combinations(np.flatnonzero(model.bodies > 0).tolist(), 2):
            pair = [i, j]
            for stretch in _stretches(columns[k][:, pair] >= 0):
                if not _is_suspect(residuals[stretch][:, pair], usual[pair], chosen.offline):
                    continue
                if _fits_better(model, positions[stretch], i, j, chosen.offline.exchange):
                    rows = stretch[:, None]
                    for table in (columns[k], confidence[k], positions):
                        table[rows, pair] = table[rows, pair[::-1]]
                    residuals[rows, pair] = np.nan
                    changed = True
    return replace(labelled, columns=columns, confidence=confidence) if changed else labelled


def _stretches(seen: Mask) -> Iterator[Index]:
    """Yield the frames of each stretch.

    It lies between frames without both markers, or has the same one of them throughout.

    seen: (T, 2) whether each marker is measured.
    """
    for wanted in (seen.any(axis=1), seen[:, 0] & ~seen[:, 1], seen[:, 1] & ~seen[:, 0]):
        frames = np.flatnonzero(wanted)
        for run in np.split(frames, np.flatnonzero(np.diff(frames) > 1) + 1):
            if len(run) >= _SHORTEST:
                yield run


def _usual(residuals: Array) -> float:
    """Return the lower quartile of residuals (T,), metres; 0 if none is known."""
    known = residuals[np.isfinite(residuals)]
    return float(np.quantile(known, 0.25)) if len(known) else 0.0


def _is_suspect(residuals: Array, usual: Array, options: OfflineOptions) -> bool:
    """Return whether a marker is farther from the hand in a stretch than usual.

    residuals: (S, 2) metres, NaN if missing.
    """
    known = np.isfinite(residuals)
    means = np.where(known, residuals, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    return bool(np.any(means > np.maximum(options.suspect_ratio * usual, options.suspect_residual)))


def _fits_better(model: MarkerModel, positions: Array, i: int, j: int, ratio: float) -> bool:
    """Return whether the hand fits positions (S, M, 3) better with i and j exchanged.

    ratio: of the mean squared residuals of both fingers, below which it does.
    """
    frames = np.unique(np.linspace(0, len(positions) - 1, min(len(positions), _SAMPLED)).astype(int))
    given = positions[frames]
    exchanged = given.copy()
    exchanged[:, [i, j]] = given[:, [j, i]]
    fingers = (model.bodies - 1) // 3
    both = np.flatnonzero((model.bodies > 0) & np.isin(fingers, fingers[[i, j]]))
    before, after = (_squares(model, each)[:, both] for each in (given, exchanged))
    if not (np.isfinite(before).any() and np.isfinite(after).any()):
        return False
    return bool(np.nanmean(after) < ratio * np.nanmean(before))


def _squares(model: MarkerModel, positions: Array) -> Array:
    """Return the squared distances (S, M), m^2, of positions from the hand fitted to each frame."""
    return np.asarray(np.sum((model.positions(frame_poses(model, positions)) - positions) ** 2, axis=-1))
