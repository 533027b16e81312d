"""The most probable joint choice of hypotheses: no two models have a common point."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from depthtrack.markers.initialisation.hypotheses import Hypothesis

_LARGEST = 50.0
"""Largest exponent of a probability."""
_NONE = b""
"""Key of a model without points."""


@dataclass(frozen=True, eq=False)
class Chosen:
    """The hypothesis of a model in the best joint choice.

    margin: energy of the best joint choice in which the model has another assignment, less that of the best one;
        infinite if there is none.
    confidence: probability of the assignment, summed over all joint choices.
    """

    hypothesis: Hypothesis
    margin: float
    confidence: float


def choose_jointly(
    found: Mapping[int, Sequence[Hypothesis]], absent: Mapping[int, float], temperature: float
) -> dict[int, Chosen | None]:
    """Return the choice of each model; None for one without points.

    found: different hypotheses of each model.
    absent: energy of each model without points.
    temperature: divides the energies.
    """
    joint = list(_disjoint(list(found), found, absent, frozenset()))
    best = min(joint, key=lambda each: each[0])
    energies = np.array([energy for energy, _ in joint]) - best[0]
    shares = np.exp(-np.minimum(energies / temperature, _LARGEST))
    chosen: dict[int, Chosen | None] = {}
    for n, (k, mine) in enumerate(zip(found, best[1], strict=True)):
        if mine is None:
            chosen[k] = None
            continue
        same = np.array([_key(choice[n]) == mine.key for _, choice in joint])
        margin = float(energies[~same].min(initial=np.inf))
        chosen[k] = Chosen(mine, margin, float(shares[same].sum() / shares.sum()))
    return chosen


def _disjoint(
    left: list[int], found: Mapping[int, Sequence[Hypothesis]], absent: Mapping[int, float], taken: frozenset[int]
) -> Iterator[tuple[float, tuple[Hypothesis | None, ...]]]:
    """Yield the energy and the hypotheses of each joint choice of the models that are left."""
    if not left:
        yield 0.0, ()
        return
    k = left[0]
    for h in (None, *found[k]):
        mine = frozenset() if h is None else frozenset(h.points[h.points >= 0].tolist())
        if not mine & taken:
            energy = absent[k] if h is None else h.energy
            yield from (
                (energy + rest, (h, *others)) for rest, others in _disjoint(left[1:], found, absent, taken | mine)
            )


def _key(hypothesis: Hypothesis | None) -> bytes:
    return _NONE if hypothesis is None else hypothesis.key
