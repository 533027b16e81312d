"""Choice of the views for calibration: frames with open fingers, and frames over time."""

from collections.abc import Callable

import cv2
import numpy as np

from depthtrack.calibration.options import ViewChoiceOptions
from depthtrack.errors import InputError
from depthtrack.recording.sequence import Sequence
from depthtrack.segmentation.morphology import disc
from depthtrack.segmentation.observation import Observation
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.selection import distinct


def choose_views(
    sequence: Sequence,
    segmenter: Segmenter,
    options: ViewChoiceOptions | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[Observation]:
    """Return the observations to calibrate on, the most open hands first.

    One half shows the most open fingers. The other is evenly spaced in time.

    progress: called with the number of inspected frames, and of all frames to inspect.

    Raises:
        InputError: if too few frames show a hand.
    """
    options = options or ViewChoiceOptions()
    count = options.views
    inspected = np.unique(np.linspace(0, len(sequence) - 1, min(len(sequence), options.inspected)).round().astype(int))
    seen: list[Observation] = []
    openness: list[float] = []
    for number, frame in enumerate(sequence.frames(inspected.tolist())):
        observation = segmenter.segment(frame)
        if observation is not None:
            seen.append(observation)
            openness.append(finger_area(observation, options.finger_half_breadth))
        if progress is not None:
            progress(number + 1, len(inspected))
    if len(seen) < options.fewest:
        raise InputError(
            f"a hand was found in {len(seen)} of {len(inspected)} frames of {sequence.name}: calibrating needs at "
            f"least {options.fewest} frames that show a bare hand, best with open fingers towards the camera"
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


def finger_area(observation: Observation, half_breadth: float = ViewChoiceOptions.finger_half_breadth) -> float:
    """Return the area of fingers, m^2: silhouette parts narrower than two `half_breadth` (m)."""
    pixel = float(observation.centre[2]) / observation.camera.fx
    silhouette = observation.silhouette.astype(np.uint8)
    palm = cv2.morphologyEx(silhouette, cv2.MORPH_OPEN, disc(max(1, round(half_breadth / pixel))))
    return float(np.count_nonzero(observation.silhouette & (palm == 0)) * pixel**2)
