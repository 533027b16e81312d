"""Rigid bodies from chosen markers of a labelled capture (Maycock et al. 2015, Sec. III-A).

A model is the positions of all markers relative to the first one. Here they are the median of all frames, and their
deviations from it are the spread.
"""

from collections.abc import Sequence

import numpy as np

from depthtrack.errors import InputError
from depthtrack.geometry.alignment import rigid_alignment
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.types import Array, Index

FEWEST_MARKERS = 3
_FRAMES = 400
"""Frames that the median is taken of, at most, spread over the capture."""
_ROUNDS = 4
_LEAST_SPREAD = 0.0003
"""Smallest standard deviation of a marker of a body, metres."""


def body_from_markers(
    capture: MarkerCapture, labels: Sequence[str], name: str, frame: int | None = None
) -> MarkerModel:
    """Return the rigid body of some markers, positions relative to the first one.

    frame: index of the only frame used; None for the median of all frames after alignment.

    Raises:
        InputError: if labels are unknown or fewer than three, or markers are never seen together.
    """
    unknown = [label for label in labels if label not in capture.labels]
    if unknown:
        raise InputError(f"the capture has no marker '{unknown[0]:.40}', it has {_listed(capture.labels)}")
    if len(labels) < FEWEST_MARKERS:
        raise InputError(f"a rigid body needs at least {FEWEST_MARKERS} markers, found {len(labels)}")
    if frame is not None and not 0 <= frame < len(capture):
        raise InputError(f"the frame must be from 1 to {len(capture)}, found {frame + 1}")
    positions = capture.selected(tuple(labels)).positions
    positions = positions[_spread_frames(positions)] if frame is None else positions[frame : frame + 1]
    pattern = _median_pattern(positions)
    lost = [label for label, place in zip(labels, pattern, strict=True) if not np.isfinite(place).all()]
    if lost:
        raise InputError(f"marker '{lost[0]:.40}' is never seen together with three others of the body: leave it out")
    deviation = _deviations(pattern, positions)
    spread = np.sqrt(np.nanmean(deviation**2, axis=0) / 3) if frame is None else np.full(len(labels), _LEAST_SPREAD)
    return MarkerModel(
        name=name,
        labels=tuple(labels),
        bodies=np.zeros(len(labels), dtype=np.int64),
        offsets=pattern - pattern[0],
        spread=np.maximum(spread, _LEAST_SPREAD),
    )


def _spread_frames(positions: Array) -> Index:
    """Return frames with at least three markers, spread over the capture."""
    usable = np.flatnonzero(np.isfinite(positions).all(axis=-1).sum(axis=1) >= FEWEST_MARKERS)
    if len(usable) == 0:
        raise InputError("no frame shows three markers of the body: choose others")
    return np.asarray(usable[np.linspace(0, len(usable) - 1, min(len(usable), _FRAMES)).round().astype(np.int64)])


def _median_pattern(positions: Array) -> Array:
    """Return the median (M, 3) of aligned frames (T, M, 3); NaN if never seen."""
    most = int(np.argmax(np.isfinite(positions).all(axis=-1).sum(axis=1)))
    pattern = positions[most].copy()
    for _ in range(_ROUNDS):
        local = _aligned(pattern, positions)
        found = np.isfinite(local).all(axis=-1).any(axis=0)
        pattern[found] = np.nanmedian(local[:, found], axis=0)
    return pattern


def _aligned(pattern: Array, positions: Array) -> Array:
    """Return frames (T, M, 3) moved onto the pattern (M, 3); NaN below three markers."""
    common = np.asarray(np.isfinite(positions).all(axis=-1) & np.isfinite(pattern).all(axis=-1))
    usable = common.sum(axis=1) >= FEWEST_MARKERS
    known = np.where(np.isfinite(pattern), pattern, 0.0)
    local = np.full_like(positions, np.nan)
    if usable.any():
        frames = positions[usable]
        R, t = rigid_alignment(known, np.where(np.isfinite(frames), frames, 0.0), common[usable])
        local[usable] = np.einsum("tji,tmj->tmi", R, frames - t[:, None])
    return local


def _deviations(pattern: Array, positions: Array) -> Array:
    """Return the distance (T, M) of the markers from the aligned pattern, metres."""
    return np.asarray(np.linalg.norm(_aligned(pattern, positions) - pattern, axis=-1))


def _listed(labels: Sequence[str]) -> str:
    shown = ", ".join(label[:24] for label in labels[:12])
    return shown if len(labels) <= 12 else f"{shown} and {len(labels) - 12} more"
