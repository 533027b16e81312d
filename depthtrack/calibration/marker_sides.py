"""The side of a hand from labelled markers: the one that fits them better."""

from dataclasses import replace

import numpy as np

from depthtrack.markers.initialisation.options import SearchOptions
from depthtrack.markers.initialisation.search import ModelSearch
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.markers.models.labelled_poses import fit_labelled_frame
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.types import Array

_FRAMES = 20
"""Frames that are fitted, at most."""


def with_measured_sides(labelled: LabelledCapture) -> LabelledCapture:
    """Return the capture with each open side as the one that fits the labels with less energy."""
    models = tuple(
        _sided(model, labelled.positions(k)) if model.open_side else model for k, model in enumerate(labelled.models)
    )
    return replace(labelled, models=models)


def _sided(model: MarkerModel, positions: Array) -> MarkerModel:
    """Return the better of both sides; positions: (T, M, 3) metres, NaN if not measured."""
    seen = np.isfinite(positions).all(axis=-1).sum(axis=1)
    parts = np.array_split(np.arange(len(seen)), min(_FRAMES, len(seen)))
    fullest = [int(part[np.argmax(seen[part])]) for part in parts]
    sides = [side.with_(open_side=False) for side in (model, model.mirrored())]
    return min(sides, key=lambda side: _energy(side, positions[fullest]))


def _energy(model: MarkerModel, positions: Array) -> float:
    fitter = ModelSearch.of(model, SearchOptions()).fitter
    return sum(fit_labelled_frame(fitter, frame)[1] for frame in positions)
