"""The labels that a capture has already, matched to models by name."""

from collections.abc import Sequence

import numpy as np

from depthtrack.hand.pose import POSE_SIZE
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.markers.models.marker_model import MarkerModel

_SEPARATORS = (":", "-", "_", ".", " ")
LEAST_SHARE = 0.5
"""Share of a model's markers that must be among the labels of a capture."""


def labels_by_name(capture: MarkerCapture, models: Sequence[MarkerModel]) -> LabelledCapture | None:
    """Return a capture with its own labels, without poses; None if it lacks those of a model.

    A label matches alone if no other model has it, or after the model's name or the first letter of a hand's side:
    `right:tip`, `R-tip`, `r_tip`.
    """
    column = {label: k for k, label in enumerate(capture.labels)}
    measured = np.asarray(np.isfinite(capture.positions).all(axis=-1))
    columns, confidence = [], []
    for model in models:
        others = {label for other in models if other is not model for label in other.labels}
        places = np.array([_place(column, model, label, label in others) for label in model.labels], dtype=np.int64)
        if np.mean(places >= 0) < LEAST_SHARE:
            return None
        seen = measured[:, places] & (places >= 0)
        columns.append(np.where(seen, places, -1))
        confidence.append(np.where(seen, 1.0, np.nan))
    poses = tuple(np.full((len(capture), POSE_SIZE), np.nan) for _ in models)
    return LabelledCapture(capture, tuple(models), tuple(columns), poses, tuple(confidence))


def _place(column: dict[str, int], model: MarkerModel, label: str, shared: bool) -> int:
    """Return the trajectory of a marker, -1 if there is none; a `shared` label needs the model before it."""
    prefixes = [model.name]
    if model.hand is not None:
        side = model.hand.side
        prefixes += [side, side.capitalize(), side[0].upper(), side[0]]
    names = [f"{prefix}{separator}{label}" for prefix in prefixes for separator in _SEPARATORS]
    found = [column[name] for name in (*names, *(() if shared else (label,))) if name in column]
    return found[0] if found else -1
