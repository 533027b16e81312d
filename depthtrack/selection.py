"""The greedy choice of items that differ from each other."""

from collections.abc import Callable, Iterable

import numpy as np

from depthtrack.types import Array


def distinct(ranked: Iterable[int], distance: Callable[[int, list[int]], Array], least: float, count: int) -> list[int]:
    """Return the first `count` indices, in order, that differ by at least `least` from those chosen before.

    distance: returns the distances (N,) of one index from N chosen ones; a distance that is NaN counts as too small.
    """
    chosen: list[int] = []
    for index in map(int, ranked):
        if len(chosen) == count:
            break
        if not chosen or np.min(distance(index, chosen)) >= least:
            chosen.append(index)
    return chosen
