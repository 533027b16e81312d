"""Initialisation beyond the paper: any posture, any size, and several models.

Markers may be missing, points may be ghosts, and hands may touch.
Rigid bodies come first, because their distances are exact. Each hand is then searched among all other points. If two
hands claim the same points, each is searched again without the points of the other, and the more probable pair is kept.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import permutations

import numpy as np

from depthtrack.markers.initialisation.hand_search import HandSearch
from depthtrack.markers.initialisation.hypotheses import Hypothesis
from depthtrack.markers.initialisation.options import SearchOptions
from depthtrack.markers.initialisation.rigid_bodies import body_hypotheses
from depthtrack.markers.initialisation.started import StartedModel
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.markers.models.sized_fit import PosturePrior, SizedFitter
from depthtrack.types import Array, Index, Mask

_BODY_CHOICES = 12
_FEWEST_POINTS = 3


@dataclass(frozen=True, eq=False)
class ModelSearch:
    """A search for a model, reused from frame to frame."""

    fitter: SizedFitter
    hand: HandSearch | None
    options: SearchOptions

    @staticmethod
    def of(model: MarkerModel, options: SearchOptions) -> "ModelSearch":
        """Return the search for a model."""
        prior = PosturePrior.from_synergies(options.widening, options.residual)
        fitter = SizedFitter(model, options.noise, prior)
        return ModelSearch(fitter, None if model.is_rigid else HandSearch(fitter, options), options)

    def hypotheses(self, points: Array, allowed: Mask) -> list[Hypothesis]:
        """Return different assignments to some of the points (K, 3), the most probable first."""
        numbers = np.flatnonzero(allowed)
        if len(numbers) < _FEWEST_POINTS:
            return []
        if self.hand is None:
            found = body_hypotheses(self.fitter, points[numbers], self.options)
        else:
            found = self.hand.hypotheses(points[numbers])
        least = self.options.least_share * len(self.fitter.weights)
        return [h.renumbered(numbers) for h in found if (h.points >= 0).sum() >= least]

    def absent(self) -> float:
        """Return the energy of a model without points."""
        return self.options.missing * len(self.fitter.weights)


def initialise_by_search(
    points: Array, models: tuple[MarkerModel, ...], options: SearchOptions
) -> tuple[StartedModel | None, ...]:
    """Return the models with the most probable assignment; None for one with too few points.

    points: (K, 3) metres, capture frame, finite.
    """
    return started_models([ModelSearch.of(model, options) for model in models], points)


def started_models(searches: list[ModelSearch], points: Array) -> tuple[StartedModel | None, ...]:
    """Return the models of searches in a frame of points (K, 3)."""
    bodies = [k for k, search in enumerate(searches) if search.hand is None]
    hands = [k for k, search in enumerate(searches) if search.hand is not None]
    every = np.ones(len(points), dtype=np.bool_)
    found = {k: searches[k].hypotheses(points, every) for k in bodies}
    found = _disjoint({k: found[k][:_BODY_CHOICES] for k in bodies}, searches)
    free = _without(every, [found[k] for k in bodies])
    found |= _hands(hands, searches, points, free)
    return tuple(_started(searches[k], found[k], points) if found[k] else None for k in range(len(searches)))


def _hands(hands: list[int], searches: list[ModelSearch], points: Array, free: Mask) -> dict[int, list[Hypothesis]]:
    """Return the hypotheses of the hands, the best ones without common points."""
    alone = {k: searches[k].hypotheses(points, free) for k in hands}
    if _are_disjoint([alone[k][0].points for k in hands if alone[k]]):
        return alone
    best, least = alone, np.inf
    for order in permutations(hands):
        left, found = free, {}
        for k in order:
            found[k] = alone[k] if left is free else searches[k].hypotheses(points, left)
            left = _without(left, [found[k]])
        energy = sum(found[k][0].energy if found[k] else searches[k].absent() for k in hands)
        if energy < least:
            best, least = found, energy
    return best


def _disjoint(found: dict[int, list[Hypothesis]], searches: list[ModelSearch]) -> dict[int, list[Hypothesis]]:
    """Return the hypotheses, the best combination without common points first."""
    keys = list(found)

    def combined(n: int, taken: frozenset[int]) -> Iterator[tuple[float, tuple[int, ...]]]:
        if n == len(keys):
            yield 0.0, ()
            return
        k = keys[n]
        for choice, h in [(-1, None), *enumerate(found[k])]:
            mine = frozenset() if h is None else frozenset(h.points[h.points >= 0].tolist())
            if not mine & taken:
                energy = searches[k].absent() if h is None else h.energy
                yield from ((energy + rest, (choice, *others)) for rest, others in combined(n + 1, taken | mine))

    _, chosen = min(combined(0, frozenset()))
    return {
        k: [] if c < 0 else [found[k][c], *found[k][:c], *found[k][c + 1 :]] for k, c in zip(keys, chosen, strict=True)
    }


def _are_disjoint(assigned: list[Index]) -> bool:
    used = np.concatenate([a[a >= 0] for a in assigned]) if assigned else np.empty(0)
    return len(np.unique(used)) == len(used)


def _without(free: Mask, found: list[list[Hypothesis]]) -> Mask:
    """Return the points that the best of some hypotheses leave."""
    left = free.copy()
    for hypotheses in found:
        if hypotheses:
            left[hypotheses[0].points[hypotheses[0].points >= 0]] = False
    return left


def _started(search: ModelSearch, found: list[Hypothesis], points: Array) -> StartedModel:
    """Return the first of different hypotheses."""
    best, energies = found[0], np.array([h.energy for h in found])
    model = search.fitter.fitted_model(best.sizes)
    seen = best.points >= 0
    e = model.positions(best.pose)[seen] - points[best.points[seen]]
    relative = energies[0] - energies
    return StartedModel(
        model=model,
        pose=best.pose,
        points=best.points,
        energy=best.energy,
        residual=float(np.sqrt(np.square(e).sum(axis=-1).mean())),
        margin=float(-relative[1:].max()) if len(found) > 1 else search.options.missing,
        confidence=float(1 / np.exp(np.minimum(relative / search.options.temperature, 50)).sum()),
    )
