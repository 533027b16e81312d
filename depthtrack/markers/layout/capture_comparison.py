"""Choices of a few markers of a capture, compared at the markers left out."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import combinations
from math import comb
from typing import Literal, NamedTuple

import numpy as np

from depthtrack.errors import InputError
from depthtrack.hand.pose import ANGLES
from depthtrack.hand.synergies import Synergies
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.markers.layout.candidates import Candidates
from depthtrack.markers.layout.options import OBJECTIVES, QualityOptions
from depthtrack.markers.layout.quality import LayoutQuality
from depthtrack.markers.layout.reconstruction import ReconstructionOptions, reconstruct
from depthtrack.markers.layout.search import find_layout_of
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.markers.sparse_poses import RECORDED
from depthtrack.types import Array, Index

_EXHAUSTIVE = 200_000
"""Choices up to which all are evaluated."""
_EVERY = 4
"""Frames of the tested half from one that is reconstructed to the next."""

Half = Literal["first", "second"]


class Choice(NamedTuple):
    """Chosen markers, and their errors at the markers that were left out.

    error: mean distance, metres.
    """

    labels: tuple[str, ...]
    error: float


class CaptureComparison(NamedTuple):
    """Choices of one number of markers.

    ours: least expected error. paper: least objective of Schroeder et al. 2015, Eq. (7).
    farthest: farthest points of the rest posture.
    random: errors (R,) of random choices, metres.
    """

    markers: int
    ours: Choice
    paper: Choice
    farthest: Choice
    random: Array


@dataclass(frozen=True, eq=False)
class HeldOutHalf:
    """A hand of a capture in two halves.

    One chooses markers, and the other is reconstructed from them.

    synergies: of the postures (N, 20) of the half that chooses, rad.
    positions: (T, M, 3) of the other half, metres.
    """

    model: MarkerModel
    candidates: Candidates
    postures: Array
    synergies: Synergies
    positions: Array

    @staticmethod
    def of(labelled: LabelledCapture, k: int, half: Half = "first", every: int = _EVERY) -> "HeldOutHalf":
        """Return the halves of the poses of model k.

        half: the one that chooses. every: frames of the other half from one that is used to the next.

        Raises:
            InputError: if the model is no hand, or was lost for most of the capture.
        """
        model, poses, positions = labelled.models[k], labelled.poses[k], labelled.positions(k)
        candidates = Candidates.of_model(model)
        known = np.flatnonzero(np.isfinite(poses).all(axis=1))
        halves = known[: len(known) // 2], known[len(known) // 2 :]
        training, test = halves if half == "first" else halves[::-1]
        test = test[::every]
        whole = np.flatnonzero(np.isfinite(positions[test]).all(axis=(1, 2)))
        if len(training) < 2 or len(whole) == 0:
            raise InputError(f"no frame in the tested half of the poses of '{model.name}' shows all markers")
        postures = np.ascontiguousarray(poses[training][:, ANGLES])
        return HeldOutHalf(model, candidates, postures, Synergies.fit(postures), positions[test[whole[0] :]])

    def quality(self, count: int, options: QualityOptions) -> LayoutQuality:
        """Return the objective for `count` markers.

        The subspace has as many synergies as their coordinates determine.
        """
        options = replace(options, anchored=False, components=self._components(count))
        return LayoutQuality.of(self.candidates, self.postures, options, self.synergies)

    def measured(self, rows: Index, options: ReconstructionOptions = RECORDED) -> Choice:
        """Return the error of the reconstruction from some of the markers."""
        model, positions = self.model, self.positions
        options = replace(options, components=self._components(len(rows)))
        poses = reconstruct(model.part(rows), positions[:, rows], self.synergies, options)
        left_out = np.setdiff1d(np.arange(len(model.labels)), rows)
        distance = np.linalg.norm(model.positions(poses)[:, left_out] - positions[:, left_out], axis=-1)
        return Choice(tuple(model.labels[row] for row in rows), float(np.nanmean(distance)))

    @staticmethod
    def _components(count: int) -> int:
        return min(QualityOptions().components, count, 3 * count - 6)


def compare_choices(
    halves: HeldOutHalf, count: int, draws: int, seed: int, progress: Callable[[float], None] = lambda share: None
) -> CaptureComparison:
    """Return the errors of choices of `count` markers.

    Raises:
        InputError: if the hand has too few markers.
    """
    total = len(halves.candidates)
    if not 3 <= count < total:
        raise InputError(f"'{halves.model.name}' has {total} markers: choose 3 to {total - 1} of them")
    generator, errors = np.random.Generator(np.random.Philox(key=[seed, count])), []
    for draw in range(draws):
        progress(draw / draws)
        errors.append(halves.measured(random_choice(total, count, generator)).error)
    ours, paper = (
        best_choice(halves.quality(count, QualityOptions(objective=name)), count, seed) for name in OBJECTIVES
    )
    return CaptureComparison(
        count,
        halves.measured(ours),
        halves.measured(paper),
        halves.measured(farthest_points(halves.candidates.rest, count)),
        np.array(errors),
    )


def random_choice(total: int, count: int, generator: np.random.Generator) -> Index:
    """Return `count` random rows of `total`, in order."""
    return np.sort(generator.permutation(total)[:count])


def farthest_points(points: Array, count: int) -> Index:
    """Return rows (count,) of points (V, 3), each farthest from those before.

    The first is farthest from the mean.
    """
    chosen = [int(np.argmax(np.linalg.norm(points - points.mean(axis=0), axis=1)))]
    while len(chosen) < count:
        distance = np.linalg.norm(points[:, None] - points[chosen], axis=-1).min(axis=1)
        chosen.append(int(np.argmax(distance)))
    return np.sort(np.array(chosen))


def best_choice(quality: LayoutQuality, count: int, seed: int) -> Index:
    """Return the best choice (count,) of candidates: of all choices if they are not too many."""
    total = len(quality.candidates)
    if comb(total, count) > _EXHAUSTIVE:
        return np.sort(find_layout_of(quality, count, seed=seed).rows)
    every = np.array(list(combinations(range(total), count)), dtype=np.int64)
    return np.asarray(every[int(np.argmin(quality.energies(every)))])
