"""The film of a page: trackers side by side, as pictures that the page's own player turns.

A codec would be smaller only where its bit rate can be told, and OpenCV's cannot; and no codec plays everywhere.
"""

from base64 import b64encode
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from io import BytesIO

import numpy as np
from PIL import Image as Pictures

from depthtrack.recording.sequence import Frame
from depthtrack.report.pictures import SideBySide
from depthtrack.types import Image
from depthtrack.viewing.annotated_frame import evenly_spaced

FASTEST = 15.0
"""Pictures a second: more would show little more."""
LEAST_PICTURES, MOST_PICTURES = 30, 400
_QUALITY = 50
_SAMPLES = 4


@dataclass(frozen=True)
class Film:
    """`pictures` as data URIs, each showing the recording at so many `seconds` from its first frame; in pixels."""

    pictures: list[str]
    seconds: list[float]
    width: int
    height: int


Progress = Callable[[Iterable[Frame], int], Iterable[Frame]]
"""Watches frames go by; told how many there are."""


def film_of(painter: SideBySide, most_bytes: int, progress: Progress = lambda frames, total: frames) -> Film:
    """The film of a recording with its trackers; evenly fewer frames, where all would take more than `most_bytes`."""
    indices = painter.indices
    times = painter.sequence.timestamps[indices]
    chosen = [indices[k] for k in evenly_spaced(len(indices), _count(painter, times, most_bytes))]
    pictures, seconds, shape = [], [], (0, 0)
    for frame in progress(painter.sequence.frames(chosen), len(chosen)):
        picture = painter.picture(frame)
        pictures.append(as_webp(picture))
        seconds.append(round(frame.timestamp - float(times[0]), 3))
        shape = picture.shape[:2]
    return Film(pictures, seconds, shape[1], shape[0])


def as_webp(image: Image, quality: int = _QUALITY) -> str:
    """The image as a data URI."""
    file = BytesIO()
    Pictures.fromarray(image).save(file, format="WEBP", quality=quality, method=2)
    return f"data:image/webp;base64,{b64encode(file.getvalue()).decode('ascii')}"


def _count(painter: SideBySide, times: np.ndarray, most_bytes: int) -> int:
    """How many frames to show: as many as are seen, unless a few samples say that they take too much."""
    wanted = min(len(times), max(1, round(FASTEST * float(times[-1] - times[0]))), MOST_PICTURES)
    samples = [painter.indices[k] for k in evenly_spaced(len(times), _SAMPLES)]
    sizes = [len(as_webp(painter.picture(frame))) for frame in painter.sequence.frames(samples)]
    affordable = int(most_bytes / np.mean(sizes))
    return min(len(times), max(min(wanted, affordable), min(wanted, LEAST_PICTURES)))
