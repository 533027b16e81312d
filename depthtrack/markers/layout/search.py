"""The search for a reduced marker layout: swarm on the skin, greedy choice, exchanges."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from depthtrack.errors import InputError
from depthtrack.machine import usable_cores
from depthtrack.markers.layout.exchange import greedy_layout, kicked
from depthtrack.markers.layout.options import LayoutOptions
from depthtrack.markers.layout.quality import LayoutQuality
from depthtrack.markers.layout.surface_swarm import FoundLayout, swarm_layout
from depthtrack.options import check_seed


def find_layout_of(
    quality: LayoutQuality,
    count: int,
    options: LayoutOptions | None = None,
    seed: int = 0,
    threads: int | None = None,
    progress: Callable[[float], None] = lambda energy: None,
) -> FoundLayout:
    """Return the best layout of `count` markers that was found.

    threads: all cores if None; their number does not change the result.
    progress: receives the least energy so far.

    Raises:
        InputError: if the markers are too few to determine the parameters, or more than there are candidates.
    """
    options = options or LayoutOptions()
    check_seed(seed)
    if not quality.fewest <= count <= min(len(quality.candidates), 64):
        raise InputError(
            f"a layout needs {quality.fewest} to {min(len(quality.candidates), 64)} markers for the objective "
            f"'{quality.options.objective}', found {count}"
        )
    generator = np.random.Generator(np.random.Philox(key=[seed, count]))
    with ThreadPoolExecutor(usable_cores() if threads is None else threads) as pool:
        # With this particle, the result is never worse than the greedy choice.
        start = greedy_layout(quality, count, pool).rows if options.greedy_particle else None
        found = swarm_layout(quality, count, generator, options.swarm, pool, progress, start)
        return kicked(quality, found.rows, options.kicks, generator, pool, progress) if options.exchange else found
