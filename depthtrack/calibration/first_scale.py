"""Size of the whole hand from single frames, before it is tracked.

A hand of a wrong size fits other things as well as the hand, such as the end of a forearm. The average hand is started
in a few frames. Hands of other sizes are fitted from its poses. The median energy has its minimum near the right size,
for hands of both sides.
"""

from collections.abc import Callable
from contextlib import closing

import numpy as np

from depthtrack.calibration.recorded_views import CalibrationSource
from depthtrack.hand.shape import HandShape, Side
from depthtrack.segmentation.observation import Observation
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.tracking.registry import create_tracker
from depthtrack.tracking.tracker import Tracker
from depthtrack.types import Array


def first_scale(source: CalibrationSource, side: Side = "right") -> float:
    """Return the scale of the hand of average proportions that fits single frames best.

    It is 1 if fewer than `CalibrationOptions.fewest` frames show a hand, or `first_scales` is empty.

    side: of the average hand; the scale hardly depends on it.
    """
    scales = sorted(source.options.first_scales)
    if len(scales) < 2:
        return scales[0] if scales else 1.0
    started = _starts(source, HandShape(side=side))
    if len(started) < source.options.fewest:
        return 1.0
    energies = around_lowest(
        len(scales),
        int(np.argmin(np.abs(np.log(scales)))),
        lambda number: _median_energy(source, HandShape(side=side, scale=scales[number]), started),
    )
    tried = sorted(energies)
    return float(np.exp(lowest_of_parabola(np.log(scales)[tried], np.array([energies[n] for n in tried]))))


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


def _starts(source: CalibrationSource, hand: HandShape) -> list[tuple[Observation, Array]]:
    """Return observations of frames spread over the recording, and poses (27,) in them."""
    sequence, count = source.sequence, source.frames or len(source.sequence)
    indices = np.linspace(0, min(len(sequence), count) - 1, source.options.scale_frames).round().astype(int)
    segmenter, found = Segmenter.for_sequence(sequence, source.segmentation), list[tuple[Observation, Array]]()
    with closing(_tracker(source, hand)) as tracker:
        for frame in sequence.frames(sorted(set(indices.tolist()))):
            segmenter.reset()
            observation = segmenter.segment(frame)
            pose = None if observation is None else tracker.start(observation).pose
            if observation is not None and pose is not None:
                found.append((observation, pose))
    return found


def _median_energy(source: CalibrationSource, hand: HandShape, started: list[tuple[Observation, Array]]) -> float:
    """Return the median energy of a hand that is fitted from poses (27,)."""
    with closing(_tracker(source, hand)) as tracker:
        return float(np.median([tracker.start(observation, pose).energy for observation, pose in started]))


def _tracker(source: CalibrationSource, hand: HandShape) -> Tracker:
    return create_tracker(source.tracker, hand, source.threads)
