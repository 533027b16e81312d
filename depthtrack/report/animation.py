"""The animation of a page: trackers side by side, as WebP images for the page's player.

Single images seek exactly and keep the size bounded. OpenCV's video encoders offer no bit rate, and no codec plays in
every browser.
"""

from base64 import b64encode
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from io import BytesIO

import numpy as np
from PIL import Image as Pictures

from depthtrack.recording.sequence import Frame
from depthtrack.report.pictures import SideBySide
from depthtrack.types import Array, Image
from depthtrack.viewing.annotated_frame import evenly_spaced

HIGHEST_RATE = 15.0
"""Images a second at most; a higher rate costs size without visible gain."""
FEWEST_IMAGES, MOST_IMAGES = 30, 400
_QUALITY = 50
_SAMPLES = 4


@dataclass(frozen=True)
class Animation:
    """Images of a recording over time.

    images: data URIs, `width` by `height` pixels each.
    seconds: time of each image since the recording's first frame.
    """

    images: list[str]
    seconds: list[float]
    width: int
    height: int


Progress = Callable[[Iterable[Frame], int], Iterable[Frame]]
"""Wraps an iterator of frames, given their number, for a progress bar."""


def make_animation(
    painter: SideBySide, most_bytes: int, progress: Progress = lambda frames, total: frames
) -> Animation:
    """Return the animation of a recording with its trackers.

    most_bytes: approximate limit of the size; if all frames exceed it, evenly spaced ones are chosen.
    """
    indices = painter.indices
    times = painter.sequence.timestamps[indices]
    chosen = [indices[k] for k in evenly_spaced(len(indices), _count(painter, times, most_bytes))]
    images, seconds, shape = [], [], (0, 0)
    for frame in progress(painter.sequence.frames(chosen), len(chosen)):
        image = painter.picture(frame)
        images.append(webp_data_uri(image))
        seconds.append(round(frame.timestamp - float(times[0]), 3))
        shape = image.shape[:2]
    return Animation(images, seconds, shape[1], shape[0])


def webp_data_uri(image: Image, quality: int = _QUALITY) -> str:
    """Encode an RGB image (h, w, 3) as a WebP data URI."""
    file = BytesIO()
    Pictures.fromarray(image).save(file, format="WEBP", quality=quality, method=2)
    return f"data:image/webp;base64,{b64encode(file.getvalue()).decode('ascii')}"


def _count(painter: SideBySide, times: Array, most_bytes: int) -> int:
    """Return the number of images, limited by rate, number and size; samples estimate the size."""
    wanted = min(len(times), max(1, round(HIGHEST_RATE * float(times[-1] - times[0]))), MOST_IMAGES)
    samples = [painter.indices[k] for k in evenly_spaced(len(times), _SAMPLES)]
    sizes = [len(webp_data_uri(painter.picture(frame))) for frame in painter.sequence.frames(samples)]
    affordable = int(most_bytes / np.mean(sizes))
    return min(len(times), max(min(wanted, affordable), min(wanted, FEWEST_IMAGES)))
