"""Choices of a few markers of a capture, compared at the markers left out."""

from collections.abc import Callable
from dataclasses import replace
from itertools import combinations
from math import comb
from typing import NamedTuple

import numpy as np

from depthtrack.errors import InputError
from depthtrack.hand.pose import ANGLES
from depthtrack.hand.synergies import Synergies
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.markers.layout.candidates import Candidates
from depthtrack.markers.layout.options import QualityOptions
from depthtrack.markers.layout.quality import LayoutQuality
from depthtrack.markers.layout.reconstruction import reconstruct
from depthtrack.markers.layout.search import find_layout_of
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.types import Array, Index

_EXHAUSTIVE = 200_000
"""Choices up to which all are evaluated."""
_EVERY = 4
"""Frames of the second half from one that is reconstructed to the next."""


class Choice(NamedTuple):
    """Chosen markers, and their errors at the markers that were left out.

    error: mean distance, metres.
    """

    labels: tuple[str, ...]
    error: float


class CaptureComparison(NamedTuple):
    """Choices of one number of markers.

    ours: least objective. farthest: farthest points of the rest posture.
    random: errors (R,) of random choices, metres.
    """

    markers: int
    ours: Choice
    farthest: Choice
    random: Array


def compare_choices(
    labelled: LabelledCapture,
    k: int,
    count: int,
    draws: int,
    seed: int,
    progress: Callable[[float], None] = lambda share: None,
) -> CaptureComparison:
    """Return the errors of choices of `count` markers of model k.

    Synergies and key-frames are those of the first half of the poses; the second half is reconstructed.

    Raises:
        InputError: if the model is no hand, has too few markers, or was lost for most of the capture.
    """
    model, poses, positions = labelled.models[k], labelled.poses[k], labelled.positions(k)
    candidates = Candidates.of_model(model)
    if not 3 <= count < len(candidates):
        raise InputError(f"'{model.name}' has {len(candidates)} markers: choose 3 to {len(candidates) - 1} of them")
    known = np.flatnonzero(np.isfinite(poses).all(axis=1))
    training, test = known[: len(known) // 2], known[len(known) // 2 :][::_EVERY]
    whole = np.flatnonzero(np.isfinite(positions[test]).all(axis=(1, 2)))
    if len(training) < 2 or len(whole) == 0:
        raise InputError(f"no frame in the second half of the poses of '{model.name}' shows all markers")
    test = test[whole[0] :]
    options = QualityOptions(anchored=False)
    # As many parameters as the coordinates determine.
    components = min(options.components, count, 3 * count - 6)
    options = replace(options, components=components)
    quality = LayoutQuality.of(candidates, np.ascontiguousarray(poses[training][:, ANGLES]), options)

    def choice(rows: Index) -> Choice:
        return _measured(model, rows, positions[test], quality.synergies)

    generator = np.random.Generator(np.random.Philox(key=[seed, count]))
    errors = []
    for draw in range(draws):
        progress(draw / draws)
        errors.append(choice(np.sort(generator.permutation(len(candidates))[:count])).error)
    return CaptureComparison(
        count, choice(_best(quality, count, seed)), choice(farthest_points(candidates.rest, count)), np.array(errors)
    )


def farthest_points(points: Array, count: int) -> Index:
    """Return rows (count,) of points (V, 3), each farthest from those before.

    The first is farthest from the mean.
    """
    chosen = [int(np.argmax(np.linalg.norm(points - points.mean(axis=0), axis=1)))]
    while len(chosen) < count:
        distance = np.linalg.norm(points[:, None] - points[chosen], axis=-1).min(axis=1)
        chosen.append(int(np.argmax(distance)))
    return np.sort(np.array(chosen))


def _best(quality: LayoutQuality, count: int, seed: int) -> Index:
    total = len(quality.candidates)
    if comb(total, count) > _EXHAUSTIVE:
        return np.sort(find_layout_of(quality, count, seed=seed).rows)
    every = np.array(list(combinations(range(total), count)), dtype=np.int64)
    return np.asarray(every[int(np.argmin(quality.energies(every)))])


def _measured(model: MarkerModel, rows: Index, positions: Array, synergies: Synergies) -> Choice:
    labels = tuple(model.labels[row] for row in rows)
    few = model.with_(labels=labels, bodies=model.bodies[rows], offsets=model.offsets[rows], spread=model.spread[rows])
    poses = reconstruct(few, positions[:, rows], synergies)
    left_out = np.setdiff1d(np.arange(len(model.labels)), rows)
    distance = np.linalg.norm(model.positions(poses)[:, left_out] - positions[:, left_out], axis=-1)
    return Choice(labels, float(np.nanmean(distance)))
