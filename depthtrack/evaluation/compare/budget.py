"""Equal time: how much work a tracker may do a frame, so that it takes the milliseconds it is given."""

import math
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from depthtrack.evaluation.compare.cpu_time import CpuTimed
from depthtrack.hand.shape import HandShape
from depthtrack.options import with_options
from depthtrack.recording.sequence import Sequence as Recording
from depthtrack.recording.status import Status
from depthtrack.segmentation.observation import Observation
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.tracking.configuration import TrackerConfig
from depthtrack.tracking.pipeline import Pipeline, track_frames
from depthtrack.tracking.registry import create_tracker
from depthtrack.tracking.tracker import Estimate

PLACES, STRETCH = 6, 6
"""Frames are timed at so many places of a recording, so many in a row."""
CLOSE = 0.04
"""A budget this close to its milliseconds, or closer, is taken."""
TRIES = 6
SMALLEST, LARGEST = 1 / 32, 64.0
"""Of the default work."""

Stretch = tuple[Estimate, list[Observation]]
"""The pose found in a frame, and the observations that follow it."""


@dataclass(frozen=True)
class Budget:
    """What calibration chose.

    config: tracker with the work that takes the time.
    ms: CPU milliseconds of the median frame with it.
    """

    config: TrackerConfig
    ms: float


def scale_work(config: TrackerConfig, size: float) -> TrackerConfig:
    """Return the configuration with `size` times its work.

    A swarm keeps the ratio of its generations to its particles, along which the error falls fastest (Oikonomidis et
    al. 2011, Fig. 2a). Surface fits first take more of the points, then more rounds.
    """
    changed: dict[str, int] = {}
    swarm, fit = getattr(config, "swarm", None), getattr(config, "fit", None)
    if swarm is not None:
        side = math.sqrt(size)
        changed["swarm.particles"] = max(4, round(swarm.particles * side))
        changed["swarm.generations"] = max(1, round(swarm.generations * side))
    if fit is not None:
        step = max(1, round(fit.subsample / math.sqrt(max(size, 1))))
        iterations = fit.icp.icp_iterations * size * step / fit.subsample
        changed["fit.icp.icp_iterations"] = min(1000, max(1, round(iterations)))
        changed["fit.subsample"] = step
    return with_options(config, changed)


def calibrate(
    recording: Recording, count: int, segmenter: Segmenter, hand: HandShape, config: TrackerConfig, ms: float
) -> Budget:
    """Return the work with which a frame takes `ms` of CPU time, from frames timed at several places.

    count: number of frames of the recording that are used.

    If even the least or the most work misses `ms`, the nearest is chosen, with its own time. If the hand is not found
    anywhere, the configuration stays as it is and the time is NaN.
    """
    places = _stretches(recording, count, segmenter, hand, config)
    if not places:
        return Budget(config, float("nan"))
    return search(lambda size: scale_work(config, size), lambda chosen: _cost(places, hand, chosen), ms)


def search(at: Callable[[float], TrackerConfig], cost: Callable[[TrackerConfig], float], ms: float) -> Budget:
    """Return the budget nearest to `ms`.

    at: returns the configuration of a size.
    cost: returns its milliseconds, about linear in size.
    """
    tried: dict[float, Budget] = {}
    size = 1.0
    for _ in range(TRIES):
        config = at(size)
        if any(budget.config == config for budget in tried.values()):
            break
        tried[size] = Budget(config, cost(config))
        if abs(tried[size].ms / ms - 1) <= CLOSE:
            break
        size = _next_size(tried, ms)
    return min(tried.values(), key=lambda budget: abs(math.log(budget.ms / ms)))


def _next_size(tried: dict[float, Budget], ms: float) -> float:
    """Return where the line through the two tries around `ms`, or nearest to it, reaches it."""
    sizes = sorted(tried)
    if len(sizes) == 1:
        # Some of the time is spent whatever the size: the first step goes further than in proportion.
        wanted = sizes[0] * ms / tried[sizes[0]].ms
    else:
        below, above = min(pairwise(sizes), key=lambda pair: abs(tried[pair[0]].ms + tried[pair[1]].ms - 2 * ms))
        slope = (tried[above].ms - tried[below].ms) / (above - below)
        wanted = below + (ms - tried[below].ms) / slope if slope > 0 else above * ms / tried[above].ms
    return min(max(wanted, SMALLEST), LARGEST)


def _cost(places: Sequence[Stretch], hand: HandShape, config: TrackerConfig) -> float:
    """Return CPU milliseconds of the median tracked frame; a frame that triggers a search costs more at any size."""
    spent: list[float] = []
    with closing(CpuTimed(create_tracker(config, hand))) as timed:
        for first, following in places:
            timed.restore([first])
            # The first frame after a restore also warms up caches and is left out.
            estimates = [timed.track(observation) for observation in following][1:]
            spent += [sum(estimate.stage_ms.values()) for estimate in estimates if estimate.status is Status.TRACKED]
    return float(np.median(spent)) if spent else float("inf")


def _stretches(
    recording: Recording, count: int, segmenter: Segmenter, hand: HandShape, config: TrackerConfig
) -> list[Stretch]:
    """Return places spread over the recording where the tracker finds and keeps the hand."""
    length = min(STRETCH + 2, count)
    firsts = sorted({round(place) for place in np.linspace(0, count - length, PLACES)})
    found = []
    for first in firsts:
        segmenter.reset()
        with closing(create_tracker(config, hand)) as tracker:
            frames = recording.frames(range(first, first + length))
            tracked = list(track_frames(frames, Pipeline(tracker, segmenter, hand)))
        seen = [each for each in tracked if each.observation is not None]
        if len(seen) >= 3 and seen[0].estimate.status.is_trusted:
            found.append((seen[0].estimate, [each.observation for each in seen[1:] if each.observation is not None]))
    return found
