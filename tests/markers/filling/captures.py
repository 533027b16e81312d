"""Labelled captures of a moving hand with gaps, for the tests of filling."""

from functools import cache

import numpy as np

from depthtrack.hand.shape import HandShape
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.markers.models.layout import load_layout
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.synthesis.motion import load_motion
from depthtrack.types import Array

RATE = 100.0


@cache
def hand() -> MarkerModel:
    return load_layout("13", HandShape())


@cache
def poses(frames: int = 400) -> Array:
    return load_motion("random").poses(np.arange(frames) / RATE, 7)


def labelled(
    positions: Array, its_poses: Array, model: MarkerModel | None = None, others: Array | None = None
) -> LabelledCapture:
    """Return the capture of one model with true labels; NaN is a gap."""
    model = model or hand()
    names = model.labels + (() if others is None else tuple(f"other_{i}" for i in range(others.shape[1])))
    everything = positions if others is None else np.concatenate([positions, others], axis=1)
    columns = np.where(np.isfinite(positions).all(axis=-1), np.arange(positions.shape[1]), -1)
    confidence = np.where(columns >= 0, 1.0, np.nan)
    return LabelledCapture(MarkerCapture(RATE, names, everything), (model,), (columns,), (its_poses,), (confidence,))


def cut(positions: Array, *gaps: tuple[str, int, int], model: MarkerModel | None = None) -> Array:
    """Return a copy of positions (T, M, 3) with gaps: label, first frame, and one past the last."""
    model, found = model or hand(), positions.copy()
    for label, start, stop in gaps:
        found[start:stop, model.labels.index(label)] = np.nan
    return found
