"""Equal time: how much work a tracker may do a frame, so that it takes the milliseconds it is given."""

import math
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from depthtrack.evaluation.compare.cpu_time import CpuTimed
from depthtrack.hand.shape import HandShape
from depthtrack.recording.sequence import Sequence as Recording
from depthtrack.recording.status import Status
from depthtrack.segmentation.observation import Observation, Segmenter
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
    """What calibration chose: the `options` that set the work, and the median frame's `ms` of CPU time with them."""

    options: dict[str, Any]
    ms: float


def scale_work(tracker: str, options: dict[str, Any], size: float) -> dict[str, Any]:
    """The options that set a tracker's work, at `size` times what all its `options` ask for.

    The swarm keeps the ratio of its generations to its particles, along which the error falls fastest (Oikonomidis
    et al. 2011, Fig. 2a). Surface fitting first takes more of the points, then more rounds.
    """
    if tracker == "pso":
        side = math.sqrt(size)
        particles, generations = options["particles"] * side, options["generations"] * side
        return {"particles": max(4, round(particles)), "generations": max(1, round(generations))}
    step = max(1, round(options["subsample"] / math.sqrt(max(size, 1))))
    rounds = options["rounds"] * size * step / options["subsample"]
    return {"rounds": min(1000, max(1, round(rounds))), "subsample": step}


def calibrate(
    recording: Recording,
    count: int,
    segmenter: Segmenter,
    hand: HandShape,
    tracker: str,
    options: dict[str, Any],
    ms: float,
) -> Budget:
    """Find the work with which a frame takes `ms` of CPU time, by timing some at several places of the first `count`.

    Where even the least or the most work misses `ms`, the nearest is taken; its own time is told. Where the hand is not
    found, nothing is chosen.
    """
    places = _stretches(recording, count, segmenter, hand, tracker, options)
    if not places:
        return Budget({}, float("nan"))

    def cost(chosen: dict[str, Any]) -> float:
        return _cost(places, hand, tracker, options | chosen)

    return search(lambda size: scale_work(tracker, options, size), cost, ms)


def search(at: Callable[[float], dict[str, Any]], cost: Callable[[dict[str, Any]], float], ms: float) -> Budget:
    """The budget nearest to `ms`: `at` gives the options of a size, `cost` their milliseconds, about linear in size."""
    tried: dict[float, Budget] = {}
    size = 1.0
    for _ in range(TRIES):
        options = at(size)
        if any(budget.options == options for budget in tried.values()):
            break
        tried[size] = Budget(options, cost(options))
        if abs(tried[size].ms / ms - 1) <= CLOSE:
            break
        size = _next_size(tried, ms)
    return min(tried.values(), key=lambda budget: abs(math.log(budget.ms / ms)))


def _next_size(tried: dict[float, Budget], ms: float) -> float:
    """Where the line through the two tries around `ms`, or nearest to it, reaches it."""
    sizes = sorted(tried)
    if len(sizes) == 1:
        # Some of the time is spent whatever the size: the first step goes further than in proportion.
        wanted = sizes[0] * ms / tried[sizes[0]].ms
    else:
        below, above = min(pairwise(sizes), key=lambda pair: abs(tried[pair[0]].ms + tried[pair[1]].ms - 2 * ms))
        slope = (tried[above].ms - tried[below].ms) / (above - below)
        wanted = below + (ms - tried[below].ms) / slope if slope > 0 else above * ms / tried[above].ms
    return min(max(wanted, SMALLEST), LARGEST)


def _cost(places: Sequence[Stretch], hand: HandShape, tracker: str, options: dict[str, Any]) -> float:
    """CPU milliseconds of an ordinary tracked frame, the median: a frame in doubt costs a search, whatever the work."""
    spent: list[float] = []
    with closing(CpuTimed(create_tracker(tracker, hand, **options))) as timed:
        for first, following in places:
            timed.restore([first])
            # The first frame after a recall also warms up caches; it counts for nothing.
            estimates = [timed.track(observation) for observation in following][1:]
            spent += [sum(estimate.stage_ms.values()) for estimate in estimates if estimate.status is Status.TRACKED]
    return float(np.median(spent)) if spent else float("inf")


def _stretches(
    recording: Recording, count: int, segmenter: Segmenter, hand: HandShape, tracker: str, options: dict[str, Any]
) -> list[Stretch]:
    """Places spread over the recording where the tracker, with the options as they are, finds and keeps the hand."""
    length = min(STRETCH + 2, count)
    firsts = sorted({round(place) for place in np.linspace(0, count - length, PLACES)})
    found = []
    with closing(create_tracker(tracker, hand, **options)) as finder:
        for first in firsts:
            segmenter.reset()
            frames = recording.frames(range(first, first + length))
            seen = [observation for observation in map(segmenter.segment, frames) if observation is not None]
            if len(seen) < 3:
                continue
            start = finder.start(seen[0])
            if start.status.is_trusted:
                found.append((start, seen[1:]))
    return found
