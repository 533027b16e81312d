"""Label a capture without labels: find the models in one frame, then follow them.

Maycock et al. 2015, Sec. III-A and III-B. The start may be in any frame: those before it are labelled backward.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from depthtrack.errors import InputError
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.exchanges import exchange_markers
from depthtrack.markers.initialisation.initialise import initialise
from depthtrack.markers.initialisation.options import InitialisationOptions
from depthtrack.markers.initialisation.started import StartedModels
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.markers.labelled_fit import fit_poses
from depthtrack.markers.labelling.offline import label_capture
from depthtrack.markers.labelling.options import LabellingOptions
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.types import Array

Progress = Callable[[str, float], None]
"""Called with the step and the share of it that is done, 0 to 1."""
SURE = 0.99
"""Probability of a right assignment at which no further frame is tried."""
SURE_SIDE = 10.0
"""Difference in energy, summed over frames, at which the other side of a hand is not tried any more."""


def find_start(
    capture: MarkerCapture,
    models: Sequence[MarkerModel],
    options: InitialisationOptions | None = None,
    frames: int = 8,
    progress: Progress | None = None,
) -> StartedModels:
    """Return the models with their most certain start in a few frames, sized by the points.

    A hand with an open side gets the one that fits better, by the sum of the energies in these frames.

    frames: number of frames that are tried at most: the first, and those with the most points in equal parts.

    Raises:
        InputError: if no model is found in any of them.
    """
    energies = dict.fromkeys(_sides(models), 0.0)
    best = dict.fromkeys(energies, StartedModels((None,) * len(models)))
    missing = (options or InitialisationOptions()).search.missing
    tried = _frames_to_try(capture, frames)
    for number, frame in enumerate(tried):
        if progress is not None:
            progress("finding the models", number / len(tried))
        for some in energies:
            found = replace(initialise(capture.points(frame)[0], some, options), frame=frame)
            energies[some] += _energy(found, some, missing)
            best[some] = max(best[some], found, key=_rank)
        likeliest = min(energies, key=lambda some: energies[some])
        energies = {some: e for some, e in energies.items() if e < energies[likeliest] + SURE_SIDE}
        chosen = best[likeliest]
        if len(energies) == 1 and chosen.confidence >= SURE:
            break
    if not chosen.found:
        names = ", ".join(model.name for model in models)
        raise InputError(f"no model ({names[:80]}) was found in {len(tried)} frames: check the models and the unit")
    return chosen


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

    Offline, markers that were exchanged while hidden are exchanged again. The poses are then those of the labels alone:
    see `labelled_fit.fit_poses`.

    models: as `sized_models` returns them, or calibrated ones.
    started: as `find_start` returns it, or as it was saved.
    """
    chosen = options or LabellingOptions()
    poses = [None if one is None else one.pose for one in started.models]
    labelled = label_capture(capture, models, chosen, poses, _starter, started.frame)
    if not chosen.offline.use:
        return labelled
    return fit_poses(exchange_markers(labelled, chosen) if chosen.offline.exchange > 0 else labelled, chosen)


def _starter(points: Array, models: tuple[MarkerModel, ...]) -> tuple[Array | None, ...]:
    """Return the poses of models among points (K, 3); None for one that is not found."""
    return tuple(None if one is None else one.pose for one in initialise(points, models).models)


def _sides(models: Sequence[MarkerModel]) -> list[tuple[MarkerModel, ...]]:
    """Return the models with each choice of the sides that are open."""
    choices = [(model, model.mirrored()) if model.open_side else (model,) for model in models]
    return [tuple(model.with_(open_side=False) for model in some) for some in product(*choices)]


def _energy(found: StartedModels, models: Sequence[MarkerModel], missing: float) -> float:
    """Return the energy of a start; a model that was not found has that of missing markers."""
    return sum(
        missing * len(model.labels) if one is None else one.energy
        for one, model in zip(found.models, models, strict=True)
    )


def _rank(started: StartedModels) -> tuple[int, float]:
    return len(started.found), started.confidence


def _frames_to_try(capture: MarkerCapture, count: int) -> list[int]:
    """Return the first frame, then of each equal part the frame with the most points."""
    points = np.isfinite(capture.positions).all(axis=-1).sum(axis=1)
    parts = np.array_split(np.arange(len(capture)), min(max(count - 1, 1), len(capture)))
    return list(dict.fromkeys([0, *(int(part[np.argmax(points[part])]) for part in parts)]))[:count]
