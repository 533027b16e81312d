"""Which frames tell most of a hand's sizes: those that show open fingers, and some of every other posture."""

from collections.abc import Callable

import cv2
import numpy as np

from depthtrack.errors import InputError
from depthtrack.recording.sequence import Sequence
from depthtrack.segmentation.observation import Observation, Segmenter
from depthtrack.segmentation.surface_grid import disc
from depthtrack.selection import distinct

_LOOKED_AT = 240
"""Frames of a recording that are looked at, at most, spread over all of it."""
_FINGER_HALF_BREADTH = 0.013
"""Metres: a disc of this radius fits into a palm, and into no finger."""
_FEWEST = 3
"""Frames with a hand below which nothing is measured."""


def choose_views(
    sequence: Sequence, segmenter: Segmenter, count: int, progress: Callable[[int, int], None] | None = None
) -> list[Observation]:
    """At most `count` observations, the most open hands first: half for their fingers, half spread over time.

    Raises InputError where hardly a frame shows a hand.
    """
    looked_at = np.unique(np.linspace(0, len(sequence) - 1, min(len(sequence), _LOOKED_AT)).round().astype(int))
    seen: list[Observation] = []
    openness: list[float] = []
    for number, frame in enumerate(sequence.frames(looked_at.tolist())):
        observation = segmenter.segment(frame)
        if observation is not None:
            seen.append(observation)
            openness.append(finger_area(observation))
        if progress is not None:
            progress(number + 1, len(looked_at))
    if len(seen) < _FEWEST:
        raise InputError(
            f"a hand was found in {len(seen)} of {len(looked_at)} frames of {sequence.name}: calibrating needs at "
            f"least {_FEWEST} frames that show a bare hand, best with open fingers towards the camera"
        )
    open_ones = distinct(
        np.argsort(openness)[::-1],
        lambda i, chosen: np.abs(i - np.array(chosen, dtype=np.float64)),
        max(1, len(seen) // (2 * count)),
        (count + 1) // 2,
    )
    others = np.linspace(0, len(seen) - 1, count).round().astype(int)
    chosen = dict.fromkeys([*open_ones, *others.tolist()])
    return [seen[i] for i in list(chosen)[:count]]


def finger_area(observation: Observation) -> float:
    """Square metres of what is narrower than a palm: fingers, as far as they are seen one by one."""
    pixel = float(observation.centre[2]) / observation.camera.fx
    skin = observation.skin.astype(np.uint8)
    palm = cv2.morphologyEx(skin, cv2.MORPH_OPEN, disc(max(1, round(_FINGER_HALF_BREADTH / pixel))))
    return float(np.count_nonzero(observation.skin & (palm == 0)) * pixel**2)
