"""Baseline: the rigid motion of the neighbours of a marker ("rigid" or "pattern fill")."""

import numpy as np

from depthtrack.geometry.alignment import rigid_alignment
from depthtrack.markers.filled_capture import Gap, measured_samples
from depthtrack.markers.filling.options import PatternFillOptions
from depthtrack.types import Array, Index, Mask


def pattern_fill(measured: Array, gaps: list[Gap], options: PatternFillOptions) -> Array:
    """Return the positions (T, M, 3) of the markers of a model in its gaps, NaN elsewhere.

    measured: (T, M, 3) metres, NaN if not measured.

    The neighbours are the markers, visible in the whole gap and beside it, whose distances from the missing one vary
    least over the capture. Their rigid motion from the frame before the gap carries the marker forwards, and that from
    the frame after it backwards; the two are blended linearly.
    """
    visible = measured_samples(measured)
    variation = _variation(measured)
    filled = np.full(measured.shape, np.nan)
    for gap in gaps:
        ends = [t for t in (gap.start - 1, gap.stop) if 0 <= t < len(measured)]
        frames = np.arange(gap.start, gap.stop)
        chosen = _neighbours(visible, variation, gap, ends, options.neighbours)
        if len(chosen) == 0 or len(ends) == 0:
            continue
        carried = [_carried(measured, gap.marker, chosen, end, frames) for end in ends]
        share = (frames - gap.start + 1)[:, None] / (gap.length + 1)
        filled[frames, gap.marker] = carried[0] if len(ends) == 1 else (1 - share) * carried[0] + share * carried[1]
    return filled


def _variation(measured: Array) -> Array:
    """Return the standard deviation (M, M) of the distances between markers, metres."""
    count = measured.shape[1]
    variation = np.full((count, count), np.nan)
    for m in range(count):
        distances = np.linalg.norm(measured - measured[:, m : m + 1], axis=-1)
        seen = np.isfinite(distances).sum(axis=0) > 1
        variation[m, seen] = np.nanstd(distances[:, seen], axis=0)
    return variation


def _neighbours(visible: Mask, variation: Array, gap: Gap, ends: list[int], count: int) -> Index:
    rows = np.concatenate([np.arange(gap.start, gap.stop), ends]).astype(np.int64)
    usable = visible[rows].all(axis=0) & np.isfinite(variation[gap.marker])
    usable[gap.marker] = False
    candidates = np.flatnonzero(usable)
    return candidates[np.argsort(variation[gap.marker, candidates], kind="stable")][:count]


def _carried(measured: Array, marker: int, neighbours: Index, end: int, frames: Index) -> Array:
    """Return the marker (n, 3), fixed to its neighbours as in the frame `end`, metres."""
    place, pattern, targets = measured[end, marker], measured[end, neighbours], measured[frames][:, neighbours]
    if len(neighbours) < 3:
        return np.asarray(place + (targets - pattern).mean(axis=1))
    R, t = rigid_alignment(pattern, targets, np.ones(targets.shape[:-1]))
    return np.asarray(np.einsum("tij,j->ti", R, place) + t)
