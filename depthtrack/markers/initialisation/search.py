"""Initialisation beyond the paper: any posture, any size, and several models.

Markers may be missing, points may be ghosts, and hands may touch.
Rigid bodies come first, because their distances are exact. Each hand is then searched among all other points. If two
hands claim the same points, each is searched again without the points of the other. The most probable hypotheses
without common points are kept together, and all such choices count in their confidence.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from depthtrack.markers.initialisation.hand_search import HandSearch
from depthtrack.markers.initialisation.hypotheses import Hypothesis, unique
from depthtrack.markers.initialisation.joint_choice import Chosen, choose_jointly
from depthtrack.markers.initialisation.options import SearchOptions
from depthtrack.markers.initialisation.rigid_bodies import body_hypotheses
from depthtrack.markers.initialisation.started import StartedModel
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.markers.models.sized_fit import PosturePrior, SizedFitter
from depthtrack.types import Array, Index, Mask

_BODY_CHOICES = 12
_HAND_CHOICES = 40
"""Most hypotheses of a search for a hand that are combined with those of other hands."""
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
    chosen = _chosen({k: searches[k].hypotheses(points, every)[:_BODY_CHOICES] for k in bodies}, searches)
    free = _without(every, [None if one is None else one.hypothesis for one in chosen.values()])
    chosen |= _chosen_hands(hands, searches, points, free)
    return tuple(_started(search, chosen[k], points) for k, search in enumerate(searches))


def _chosen_hands(hands: list[int], searches: list[ModelSearch], points: Array, free: Mask) -> dict[int, Chosen | None]:
    """Return the choice of each hand; those that claim common points are searched again."""
    found = {k: searches[k].hypotheses(points, free)[:_HAND_CHOICES] for k in hands}
    best = {k: some[0] for k, some in found.items() if some}
    contested = not _are_disjoint([h.points for h in best.values()])
    for k in hands if contested else ():
        left = _without(free, [h for other, h in best.items() if other != k])
        found[k] = unique([*found[k], *searches[k].hypotheses(points, left)[:_HAND_CHOICES]])
    return _chosen(found, searches, contested)


def _chosen(
    found: dict[int, list[Hypothesis]], searches: list[ModelSearch], contested: bool = False
) -> dict[int, Chosen | None]:
    if not found:
        return {}
    options, absent = searches[0].options, {k: searches[k].absent() for k in found}
    return choose_jointly(found, absent, options.temperature * (options.contested if contested else 1.0))


def _are_disjoint(assigned: list[Index]) -> bool:
    used = np.concatenate([a[a >= 0] for a in assigned]) if assigned else np.empty(0)
    return len(np.unique(used)) == len(used)


def _without(free: Mask, found: Iterable[Hypothesis | None]) -> Mask:
    """Return the points that some hypotheses leave."""
    left = free.copy()
    for h in found:
        if h is not None:
            left[h.points[h.points >= 0]] = False
    return left


def _started(search: ModelSearch, chosen: Chosen | None, points: Array) -> StartedModel | None:
    if chosen is None:
        return None
    best = chosen.hypothesis
    model = search.fitter.fitted_model(best.sizes)
    seen = best.points >= 0
    e = model.positions(best.pose)[seen] - points[best.points[seen]]
    return StartedModel(
        model=model,
        pose=best.pose,
        points=best.points,
        energy=best.energy,
        residual=float(np.sqrt(np.square(e).sum(axis=-1).mean())),
        margin=chosen.margin if np.isfinite(chosen.margin) else search.options.missing,
        confidence=chosen.confidence,
    )
