"""Greedy choice of markers, and exchange of single markers (Schroeder et al. 2015, Sec. 6).

The paper adapts farthest-point optimisation (Schloemer, Heck and Deussen 2011) in these two steps.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from depthtrack.markers.layout.quality import LayoutQuality
from depthtrack.markers.layout.surface_swarm import FoundLayout
from depthtrack.types import Index

_LEAST_GAIN = 1e-12
"""Relative decrease of the energy that an exchange must bring."""

_KICKED = 3
"""Markers that a random change moves."""

Progress = Callable[[float], None]


def greedy_layout(
    quality: LayoutQuality, count: int, pool: ThreadPoolExecutor | None = None, progress: Progress = lambda energy: None
) -> FoundLayout:
    """Return the layout of the greedy baseline: markers added and exchanged one by one."""
    return exchanged(quality, added(quality, count, pool), pool, progress)


def added(quality: LayoutQuality, count: int, pool: ThreadPoolExecutor | None = None) -> Index:
    """Return the layout (count,) that grows by the marker with the least energy.

    A layout too small to determine the parameters has the largest condition number, so its distance alone decides.
    """
    # The first marker is the one farthest from the wrist; without others it has no distance.
    rest = quality.candidates.rest
    chosen = np.array([int(np.argmax(np.linalg.norm(rest - quality.candidates.hand.wrist, axis=1)))])
    while len(chosen) < count:
        chosen = np.append(chosen, int(np.argmin(quality.grown(chosen, np.inf, pool))))
    return chosen


def kicked(
    quality: LayoutQuality,
    start: Index,
    kicks: int,
    generator: np.random.Generator,
    pool: ThreadPoolExecutor | None = None,
    progress: Progress = lambda energy: None,
) -> FoundLayout:
    """Return the best layout of exchanges from `start` (K,) and from random changes.

    Each of `kicks` changes moves three random markers of the best layout to random places. This is iterated local
    search (Lourenco, Martin and Stuetzle 2003).
    """
    best = exchanged(quality, start, pool, progress)
    for _ in range(kicks):
        changed = best.rows.copy()
        moved = generator.permutation(len(changed))[:_KICKED]
        changed[moved] = quality.candidates.random_rows(len(moved), generator)
        found = exchanged(quality, changed, pool)
        if found.energy < best.energy - _LEAST_GAIN * abs(best.energy):
            best = found
        progress(best.energy)
    return best


def exchanged(
    quality: LayoutQuality,
    start: Index,
    pool: ThreadPoolExecutor | None = None,
    progress: Progress = lambda energy: None,
) -> FoundLayout:
    """Return the layout that no exchange of one marker improves, reached from `start` (K,).

    Each marker in turn gets the best place. progress: receives the energy after each exchange that was tried.
    """
    layout = np.array(start, dtype=np.int64)
    energy, tried, k = float(quality.energies(layout[None])[0]), 0, 0
    while tried < len(layout):
        least = energy - _LEAST_GAIN * abs(energy)
        found = quality.grown(np.delete(layout, k), least, pool)
        best = int(np.argmin(found))
        tried += 1
        if found[best] < least:
            layout[k], energy, tried = best, float(found[best]), 1
        progress(energy)
        k = (k + 1) % len(layout)
    return FoundLayout(layout, energy)
