"""The labels that a capture has already, matched to models by name."""

from collections.abc import Sequence

import numpy as np

from depthtrack.hand.pose import POSE_SIZE
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.markers.models.marker_model import MarkerModel

LEAST_SHARE = 0.5
"""Share of a model's markers that must be among the labels of a capture."""


def labels_by_name(capture: MarkerCapture, models: Sequence[MarkerModel]) -> LabelledCapture | None:
    """Return a capture with its own labels, without poses; None if it lacks those of a model.

    A label matches with the model's name and a colon before it, or alone if no other model has it.
    """
    column = {label: k for k, label in enumerate(capture.labels)}
    measured = np.asarray(np.isfinite(capture.positions).all(axis=-1))
    columns, confidence = [], []
    for model in models:
        others = {label for other in models if other is not model for label in other.labels}
        places = np.array(
            [
                column.get(f"{model.name}:{label}", -1 if label in others else column.get(label, -1))
                for label in model.labels
            ],
            dtype=np.int64,
        )
        if np.mean(places >= 0) < LEAST_SHARE:
            return None
        seen = measured[:, places] & (places >= 0)
        columns.append(np.where(seen, places, -1))
        confidence.append(np.where(seen, 1.0, np.nan))
    poses = tuple(np.full((len(capture), POSE_SIZE), np.nan) for _ in models)
    return LabelledCapture(capture, tuple(models), tuple(columns), poses, tuple(confidence))
