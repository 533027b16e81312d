"""Label a capture without labels: find the models in one frame, then follow them.

Maycock et al. 2015, Sec. III-A and III-B. Any frame may be the first: the frames before it are labelled backward.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from depthtrack.errors import InputError
from depthtrack.hand.pose import POSE_SIZE
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.initialisation.initialise import initialise
from depthtrack.markers.initialisation.options import InitialisationOptions
from depthtrack.markers.initialisation.started import StartedModels
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.markers.labelling.offline import label_capture
from depthtrack.markers.labelling.options import LabellingOptions
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.types import Array, Index

Progress = Callable[[str, float], None]
"""Called with the step and the share of it that is done, 0 to 1."""
SURE = 0.99
"""Probability of a right assignment at which no further frame is tried."""


def find_start(
    capture: MarkerCapture,
    models: Sequence[MarkerModel],
    options: InitialisationOptions | None = None,
    frames: int = 8,
    progress: Progress | None = None,
) -> StartedModels:
    """Return the models with their most certain start in a few frames, sized by the points.

    frames: number of frames that are tried at most: the first, and those with the most points in equal parts.

    Raises:
        InputError: if no model is found in any of them.
    """
    best = StartedModels((None,) * len(models))
    tried = _frames_to_try(capture, frames)
    for number, frame in enumerate(tried):
        if progress is not None:
            progress("finding the models", number / len(tried))
        found = replace(initialise(capture.points(frame)[0], models, options), frame=frame)
        if _rank(found) > _rank(best):
            best = found
        if best.confidence >= SURE:
            break
    if not best.found:
        names = ", ".join(model.name for model in models)
        raise InputError(f"none of the models {names[:80]} is found in {len(tried)} frames: check models and unit")
    return best


def sized_models(models: Sequence[MarkerModel], started: StartedModels) -> tuple[MarkerModel, ...]:
    """Return the models with the sizes that a start found."""
    return tuple(model if one is None else one.model for model, one in zip(models, started.models, strict=True))


def label_from(
    capture: MarkerCapture,
    models: Sequence[MarkerModel],
    started: StartedModels,
    options: LabellingOptions | None = None,
) -> LabelledCapture:
    """Return the labels and poses of all frames, from the frame of a start in both directions.

    models: as `sized_models` returns them, or calibrated ones.
    started: as `find_start` returns it, or as it was saved.
    """
    options = options or LabellingOptions()
    poses = [None if one is None else one.pose for one in started.models]
    frame = started.frame
    after = label_capture(capture.between(frame, len(capture)), models, options, poses)
    if frame == 0 or not options.offline.use:
        return _joined(capture, _nothing(models, frame), after)
    before = label_capture(_reversed(capture.between(0, frame + 1)), models, options, poses)
    return _joined(capture, _reversed_labels(before), after)


def _rank(started: StartedModels) -> tuple[int, float]:
    return len(started.found), started.confidence


def _frames_to_try(capture: MarkerCapture, count: int) -> list[int]:
    """Return the first frame, then of each equal part the frame with the most points."""
    points = np.isfinite(capture.positions).all(axis=-1).sum(axis=1)
    parts = np.array_split(np.arange(len(capture)), min(max(count - 1, 1), len(capture)))
    return list(dict.fromkeys([0, *(int(part[np.argmax(points[part])]) for part in parts)]))[:count]


def _reversed(capture: MarkerCapture) -> MarkerCapture:
    return replace(capture, positions=capture.positions[::-1], residuals=None)


class Parts(NamedTuple):
    """Columns, poses and confidence of some frames, for each model."""

    columns: tuple[Index, ...]
    poses: tuple[Array, ...]
    confidence: tuple[Array, ...]


def _reversed_labels(labelled: LabelledCapture) -> Parts:
    """Return the frames in the usual order, without the last, which is that of the start."""
    return Parts(
        tuple(each[:0:-1] for each in labelled.columns),
        tuple(each[:0:-1] for each in labelled.poses),
        tuple(each[:0:-1] for each in labelled.confidence),
    )


def _nothing(models: Sequence[MarkerModel], frames: int) -> Parts:
    """Return frames without labels."""
    shapes = [(frames, len(model.labels)) for model in models]
    return Parts(
        tuple(np.full(shape, -1, dtype=np.int64) for shape in shapes),
        tuple(np.full((frames, POSE_SIZE), np.nan) for _ in models),
        tuple(np.full(shape, np.nan) for shape in shapes),
    )


def _joined(capture: MarkerCapture, before: Parts, after: LabelledCapture) -> LabelledCapture:
    return LabelledCapture(
        capture,
        after.models,
        tuple(np.concatenate(pair) for pair in zip(before.columns, after.columns, strict=True)),
        tuple(np.concatenate(pair) for pair in zip(before.poses, after.poses, strict=True)),
        tuple(np.concatenate(pair) for pair in zip(before.confidence, after.confidence, strict=True)),
    )
