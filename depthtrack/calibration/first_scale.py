"""Size of the whole hand from single frames, before it is tracked.

A hand of a wrong size fits other things as well as the hand, such as the end of a forearm. The average hand is started
in a few frames. Hands of other sizes are fitted from its poses. The median energy has its minimum near the right size.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from functools import partial
from typing import NamedTuple

import numpy as np

from depthtrack.calibration.recorded_views import CalibrationSource
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape, Side
from depthtrack.recording.sequence import Frame
from depthtrack.segmentation.observation import Observation
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.tracking.guided_segmentation import around_start, segment_start
from depthtrack.tracking.registry import create_tracker
from depthtrack.tracking.stretches import Starts
from depthtrack.tracking.tracker import Estimate
from depthtrack.types import Array


class FirstHand(NamedTuple):
    """Hand of average proportions, before it is tracked.

    scale: of the hand.
    starts: estimates in single frames, of a hand of about this scale, whose confidence is high enough.
    """

    scale: float
    starts: Starts


def first_hand(source: CalibrationSource, side: Side = "right") -> FirstHand:
    """Return the hand of average proportions whose scale fits single frames best.

    Its scale is 1 if fewer than `CalibrationOptions.fewest` frames show a hand, or `first_scales` is empty.

    side: of the hand. A hand of the wrong side is often smaller.
    """
    scales = sorted(source.options.first_scales)
    if len(scales) < 2:
        return FirstHand(scales[0] if scales else 1.0, {})
    with ThreadPoolExecutor(source.threads, "starts") as pool:
        started = _starts(source, HandShape(side=side), pool)
        if len(started) < source.options.fewest:
            return FirstHand(1.0, {})
        scale, estimates = best_scale(
            scales, lambda each: list(pool.map(partial(_fit, source, HandShape(side=side, scale=each)), started))
        )
    frames, least = [each.observation.frame_index for each in started], source.options.first_confidence
    return FirstHand(scale, {n: (e,) for n, e in zip(frames, estimates, strict=True) if e.confidence >= least})


def best_scale(scales: Sequence[float], fitted: Callable[[float], list[Estimate]]) -> tuple[float, list[Estimate]]:
    """Return the scale of the lowest median energy, and estimates of a hand of about it.

    scales: to compare, in increasing order.
    fitted: returns the estimates of a hand of a scale in some frames.
    """
    found = dict[int, list[Estimate]]()

    def energy(number: int) -> float:
        found[number] = fitted(scales[number])
        return float(np.median([estimate.energy for estimate in found[number]]))

    energies = around_lowest(len(scales), int(np.argmin(np.abs(np.log(scales)))), energy)
    tried = sorted(energies)
    lowest = lowest_of_parabola(np.log(scales)[tried], np.array([energies[number] for number in tried]))
    return float(np.exp(lowest)), found[min(energies, key=energies.__getitem__)]


def around_lowest(count: int, first: int, energy: Callable[[int], float]) -> dict[int, float]:
    """Return the energies of a minimum, its neighbours and others on the way to it.

    They have the numbers 0 to `count` - 1.

    first: number near which the minimum is; the search goes downhill from it.
    """
    energies = {number: energy(number) for number in range(max(first - 1, 0), min(first + 2, count))}
    while True:
        lowest = min(energies, key=energies.__getitem__)
        absent = [n for n in (lowest - 1, lowest + 1) if 0 <= n < count and n not in energies]
        if not absent:
            return energies
        energies |= {number: energy(number) for number in absent}


def lowest_of_parabola(x: Array, y: Array) -> float:
    """Return the place of the minimum of y (N,) over increasing x (N,), between its samples.

    It is that of the parabola through the lowest sample and its neighbours, or the first or last sample.
    """
    lowest = int(np.argmin(y))
    if not 0 < lowest < len(x) - 1:
        return float(x[lowest])
    near = slice(lowest - 1, lowest + 2)
    curvature, slope, _ = np.polyfit(x[near] - x[lowest], y[near], 2)
    return float(x[lowest] - slope / (2 * curvature)) if curvature > 0 else float(x[lowest])


class _Start(NamedTuple):
    """An observation, and a pose (27,) in it."""

    observation: Observation
    pose: Array


def _starts(source: CalibrationSource, hand: HandShape, pool: ThreadPoolExecutor) -> list[_Start]:
    """Return starts of a hand in frames spread over the recording, without those that show none."""
    found = pool.map(partial(_start, source, hand), source.sequence.frames(source.first_frames))
    return [each for each in found if each is not None]


def _start(source: CalibrationSource, hand: HandShape, frame: Frame) -> _Start | None:
    """Return the start of a hand in a frame, if it shows one."""
    segmenter = Segmenter.for_sequence(source.sequence, source.segmentation)
    observation = segment_start(frame, segmenter, HandModel(hand))
    if observation is None:
        return None
    with closing(create_tracker(source.tracker, hand)) as tracker:
        found = tracker.start(observation)
    around, _ = around_start(frame, observation, found, segmenter, HandModel(hand))
    return None if found.pose is None or around is None else _Start(around, found.pose)


def _fit(source: CalibrationSource, hand: HandShape, start: _Start) -> Estimate:
    """Return the estimate of a hand that is fitted from the pose of another one."""
    with closing(create_tracker(source.tracker, hand)) as tracker:
        return tracker.start(*start)
