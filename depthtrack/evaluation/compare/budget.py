"""Equal time: choose the work of a tracker so that a frame takes given milliseconds."""

import math
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from depthtrack.evaluation.compare.cpu_time import CpuTimed
from depthtrack.hand.shape import HandShape
from depthtrack.options import with_options
from depthtrack.recording.keypoints import KeypointFile
from depthtrack.recording.sequence import Sequence as Recording
from depthtrack.recording.status import Status
from depthtrack.segmentation.observation import Observation
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.tracking.configuration import TrackerConfig
from depthtrack.tracking.pipeline import Pipeline, track_frames
from depthtrack.tracking.registry import create_tracker
from depthtrack.tracking.tracker import Estimate

PLACES, STRETCH = 6, 6
"""Number of places in a recording at which frames are timed, and of consecutive frames at each."""
TOLERANCE = 0.04
"""Relative difference from the milliseconds at which the search stops."""
TRIES = 6
"""Largest number of timed sizes."""
SMALLEST, LARGEST = 1 / 32, 64.0
"""Range of the size, as a factor on the default work."""

Stretch = tuple[Estimate, list[Observation]]
"""Estimate of a frame, and the observations of the frames after it."""


@dataclass(frozen=True)
class Budget:
    """Work of a tracker and the time that it takes.

    config: configuration of the tracker.
    ms: CPU milliseconds of the median frame.
    """

    config: TrackerConfig
    ms: float


def scale_work(config: TrackerConfig, size: float) -> TrackerConfig:
    """Return the configuration with `size` times its work.

    A swarm keeps the ratio of its generations to its particles, along which the error falls fastest (Oikonomidis et
    al. 2011, Fig. 2a). A surface fit first takes more points, then more iterations.
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
    recording: Recording,
    count: int,
    segmenter: Segmenter,
    hand: HandShape,
    config: TrackerConfig,
    ms: float,
    keypoints: KeypointFile | None = None,
) -> Budget:
    """Return the budget with which a frame takes `ms` of CPU time.

    count: number of frames of the recording to use.
    config: configuration with the default work.
    keypoints: of the recording, from elsewhere.

    If even the least or the most work misses `ms`, the nearest time is chosen. If the hand is found nowhere, `config`
    is returned and the time is NaN.
    """
    places = _stretches(recording, count, segmenter, hand, config, keypoints)
    if not places:
        return Budget(config, float("nan"))
    return search(lambda size: scale_work(config, size), lambda chosen: _cost(places, hand, chosen), ms)


def search(at: Callable[[float], TrackerConfig], cost: Callable[[TrackerConfig], float], ms: float) -> Budget:
    """Return the budget whose time is nearest to `ms`.

    at: returns the configuration of a size.
    cost: returns the milliseconds of a configuration, about linear in its size.
    """
    tried: dict[float, Budget] = {}
    size = 1.0
    for _ in range(TRIES):
        config = at(size)
        if any(budget.config == config for budget in tried.values()):
            break
        tried[size] = Budget(config, cost(config))
        if abs(tried[size].ms / ms - 1) <= TOLERANCE:
            break
        size = _next_size(tried, ms)
    return min(tried.values(), key=lambda budget: abs(math.log(budget.ms / ms)))


def _next_size(tried: dict[float, Budget], ms: float) -> float:
    """Return the size at which the line through the two tries nearest to `ms` reaches `ms`."""
    sizes = sorted(tried)
    if len(sizes) == 1:
        # A part of the time does not depend on the size, so a proportional step is a first guess only.
        wanted = sizes[0] * ms / tried[sizes[0]].ms
    else:
        below, above = min(pairwise(sizes), key=lambda pair: abs(tried[pair[0]].ms + tried[pair[1]].ms - 2 * ms))
        slope = (tried[above].ms - tried[below].ms) / (above - below)
        wanted = below + (ms - tried[below].ms) / slope if slope > 0 else above * ms / tried[above].ms
    return min(max(wanted, SMALLEST), LARGEST)


def _cost(places: Sequence[Stretch], hand: HandShape, config: TrackerConfig) -> float:
    """Return CPU milliseconds of the median tracked frame.

    The median leaves out frames that trigger a search, whose cost does not depend on the size.
    """
    spent: list[float] = []
    with closing(CpuTimed(create_tracker(config, hand))) as timed:
        for first, following in places:
            timed.restore([first])
            # The first frame after a restore also warms up caches and is left out.
            estimates = [timed.track(observation) for observation in following][1:]
            spent += [sum(estimate.stage_ms.values()) for estimate in estimates if estimate.status is Status.TRACKED]
    return float(np.median(spent)) if spent else float("inf")


def _stretches(
    recording: Recording,
    count: int,
    segmenter: Segmenter,
    hand: HandShape,
    config: TrackerConfig,
    keypoints: KeypointFile | None,
) -> list[Stretch]:
    """Return evenly spaced stretches of the recording in which the tracker follows the hand."""
    length = min(STRETCH + 2, count)
    firsts = sorted({round(place) for place in np.linspace(0, count - length, PLACES)})
    found = []
    for first in firsts:
        segmenter.reset()
        with closing(create_tracker(config, hand)) as tracker:
            frames = recording.frames(range(first, first + length))
            if keypoints is not None:
                frames = keypoints.attach(frames, recording.timestamps)
            tracked = list(track_frames(frames, Pipeline(tracker, segmenter, hand)))
        observed = [each for each in tracked if each.observation is not None]
        if len(observed) >= 3 and observed[0].estimate.status.is_trusted:
            following = [each.observation for each in observed[1:] if each.observation is not None]
            found.append((observed[0].estimate, following))
    return found
