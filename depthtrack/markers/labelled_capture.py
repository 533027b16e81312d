"""A capture with labels and poses: its points are assigned to the markers of models."""

from dataclasses import dataclass, replace
from itertools import count

import numpy as np

from depthtrack.markers.capture import UNLABELLED, MarkerCapture
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.types import Array, Index


@dataclass(frozen=True, eq=False)
class LabelledCapture:
    """Labels and poses of models in a capture.

    The tuples have an entry for each model; model k has M markers.

    columns: (T, M) trajectory of the capture that holds the marker in each frame; -1 if it was not measured.
    poses: (T, 27) capture frame, metres and radians; NaN while a model is lost.
    confidence: (T, M) probability that the label is right; NaN without a point.
    """

    capture: MarkerCapture
    models: tuple[MarkerModel, ...]
    columns: tuple[Index, ...]
    poses: tuple[Array, ...]
    confidence: tuple[Array, ...]

    def positions(self, k: int) -> Array:
        """Return the measured markers (T, M, 3) of model k, metres; NaN if not measured."""
        chosen = self.columns[k]
        rows = np.arange(len(self.capture))[:, None]
        return np.where((chosen >= 0)[..., None], self.capture.positions[rows, np.maximum(chosen, 0)], np.nan)

    def residuals(self, k: int) -> Array:
        """Return the distances (T, M), metres, of measured markers of model k from its pose."""
        return np.asarray(np.linalg.norm(self.positions(k) - self.models[k].positions(self.poses[k]), axis=-1))

    def labels(self, k: int) -> tuple[str, ...]:
        """Return the labels of model k, after its name and a colon if there are several models."""
        model = self.models[k]
        return tuple(f"{model.name}:{label}" if len(self.models) > 1 else label for label in model.labels)

    def labelled(self) -> MarkerCapture:
        """Return the capture of the labelled markers alone, one trajectory each."""
        labels = tuple(label for k in range(len(self.models)) for label in self.labels(k))
        positions = np.concatenate([self.positions(k) for k in range(len(self.models))], axis=1)
        return replace(self.capture, labels=labels, positions=positions, residuals=None, notes=())

    def rest(self) -> MarkerCapture:
        """Return the capture of the points without a label.

        A trajectory keeps its own label unless a marker has it; it is unlabelled then.
        """
        positions = self.capture.positions.copy()
        for columns in self.columns:
            frames, markers = np.nonzero(columns >= 0)
            positions[frames, columns[frames, markers]] = np.nan
        left = np.flatnonzero(np.isfinite(positions).all(axis=-1).any(axis=0))
        taken = {label for k in range(len(self.models)) for label in self.labels(k)}
        named = [self.capture.labels[column] for column in left]
        free = (label for n in count(1) if (label := f"{UNLABELLED}{n}") not in self.capture.labels)
        labels = tuple(next(free) if label in taken else label for label in named)
        return replace(self.capture, labels=labels, positions=positions[:, left], residuals=None, notes=())
