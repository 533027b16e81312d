"""The labels that a capture has already, matched to models by name."""

import re
from collections.abc import Sequence

import numpy as np

from depthtrack.hand.pose import POSE_SIZE
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.types import Index

LEAST_SHARE = 0.5
"""Share of a model's markers that must be among the labels of a capture."""


def places_by_name(labels: Sequence[str], models: Sequence[MarkerModel]) -> tuple[Index, ...]:
    """Return the place (M,) among labels of each marker of each model; -1 if it is not there.

    A label is compared after the name of its model, and after the side of a hand or its first letter. It is compared
    alone if no other model has it. Case and punctuation are ignored: `right:A1` is `R-A1`.
    """
    place = {_key(label): n for n, label in enumerate(labels)}
    plain = [label for model in models for label in model.labels]
    found = []
    for model in models:
        sides = [] if model.hand is None else [model.hand.side, model.hand.side[0]]
        if model.open_side:
            sides += [model.mirrored().name, model.mirrored().name[0]]
        names = [
            [*(f"{prefix}:{label}" for prefix in (model.name, *sides)), *([label] if plain.count(label) == 1 else [])]
            for label in model.labels
        ]
        found.append(
            np.array([next((place[_key(n)] for n in some if _key(n) in place), -1) for some in names], dtype=np.int64)
        )
    return tuple(found)


def labels_by_name(capture: MarkerCapture, models: Sequence[MarkerModel]) -> LabelledCapture | None:
    """Return a capture with its own labels, without poses; None if it lacks those of a model.

    See `places_by_name`.
    """
    measured = np.asarray(np.isfinite(capture.positions).all(axis=-1))
    columns, confidence = [], []
    for places in places_by_name(capture.labels, models):
        if np.mean(places >= 0) < LEAST_SHARE:
            return None
        seen = measured[:, places] & (places >= 0)
        columns.append(np.where(seen, places, -1))
        confidence.append(np.where(seen, 1.0, np.nan))
    poses = tuple(np.full((len(capture), POSE_SIZE), np.nan) for _ in models)
    return LabelledCapture(capture, tuple(models), tuple(columns), poses, tuple(confidence))


def _key(label: str) -> str:
    return re.sub(r"[\W_]", "", label).lower()
