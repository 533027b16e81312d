"""Greedy selection of items that differ from each other."""

from collections.abc import Callable, Iterable

import numpy as np

from depthtrack.types import Array


def distinct(ranked: Iterable[int], distance: Callable[[int, list[int]], Array], least: float, count: int) -> list[int]:
    """Return up to `count` indices, in order, that are at least `least` apart.

    distance: returns the distances (N,) of one index from N chosen ones; NaN counts as too small.
    """
    chosen: list[int] = []
    for index in map(int, ranked):
        if len(chosen) == count:
            break
        if not chosen or np.min(distance(index, chosen)) >= least:
            chosen.append(index)
    return chosen
