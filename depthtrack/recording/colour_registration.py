"""Registration of colour to depth, checked by their edges.

Edges of depth are edges of objects, where colour changes too. If colour is shifted, the two edge images correlate best
at that shift.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from depthtrack.errors import DamagedFrameError
from depthtrack.recording.sequence import Frame, Sequence
from depthtrack.types import Array, Depth, Image

Edges = NDArray[np.float32]
LEAST_SHIFT = 4.0
"""Shift between colour and depth that is reported, pixels: one of 5, which is found to a pixel."""
_FRAMES = 8
_FARTHEST = 0.1
"""Largest shift that is searched, in widths of the image."""
_DEPTH_STEP = 0.04
"""Relative step of depth at the edge of an object."""
_LEAST_EDGES = 300
"""Pixels of depth edges in all frames together that a shift is measured with."""
LEAST_GAIN = 1.03
"""Factor by which edges correlate better at a shift that is reported than without it, by tools/tune_colour_shift.py."""
_WINDOW = np.ones((3, 3), np.uint8)
_BLUR = 1.5
"""Standard deviation of the edges, pixels: registered colour may be off by so much."""


@dataclass(frozen=True)
class ColourShift:
    """Shift of colour against depth.

    pixels: (right, down) by which colour lies from the depth.
    gain: correlation of the edges at that shift by that without a shift.
    """

    pixels: tuple[float, float]
    gain: float

    @property
    def is_sure(self) -> bool:
        """Whether the colour is not registered to the depth."""
        return float(np.hypot(*self.pixels)) >= LEAST_SHIFT and self.gain >= LEAST_GAIN

    @property
    def note(self) -> str:
        """Sentence for the user."""
        right, down = self.pixels
        return (
            f"colour is not registered: its edges lie {right:+.0f} pixels across and {down:+.0f} down from the depth's"
        )


def measure_shift(sequence: Sequence) -> ColourShift | None:
    """Return the shift of the colour in a few frames; None without edges or colour."""
    correlation = edge_correlation(list(coloured_frames(sequence)))
    return None if correlation is None else best_shift(correlation)


def edge_correlation(frames: list[Frame]) -> Array | None:
    """Return the circular correlation (h, w) of edges of depth and colour, by shift.

    It is the sum over frames with colour. Rows are shifts down, columns shifts to the right.
    None is returned if there are few edges.
    """
    for edges_of in (depth_edges, silhouette_edges):
        edges = [edges_of(frame.depth) for frame in frames]
        if sum(int(each.sum()) for each in edges) >= _LEAST_EDGES:
            pairs = zip(edges, frames, strict=True)
            correlations = [_correlation(each, colour_edges(_colour(frame))) for each, frame in pairs]
            return np.asarray(np.sum(correlations, axis=0))
    return None


def coloured_frames(sequence: Sequence) -> Iterator[Frame]:
    """Yield a few readable frames with colour."""
    for index in np.unique(np.linspace(0, len(sequence) - 1, _FRAMES).astype(int)):
        try:
            frame = sequence[int(index)]
        except DamagedFrameError:
            continue
        if frame.colour is not None:
            yield frame


def depth_edges(depth: Depth) -> Edges:
    """Return 1 (h, w) on the near side of steps in depth, also across gaps of missing readings."""
    farthest = cv2.dilate(depth, np.ones((9, 9), np.uint8))
    near = (depth > 0) & (farthest > (1 + _DEPTH_STEP) * depth)
    steps = cv2.dilate(depth, _WINDOW) > (1 + _DEPTH_STEP) * depth
    return (near & (steps | (silhouette_edges(depth) > 0))).astype(np.float32)


def silhouette_edges(depth: Depth) -> Edges:
    """Return 1 (h, w) on readings beside missing ones: the edges of objects before nothing."""
    inner = cv2.erode((depth > 0).astype(np.uint8), _WINDOW)
    return ((depth > 0) & (inner == 0)).astype(np.float32)


def colour_edges(colour: Image) -> Edges:
    """Return the strength (h, w) of the edges of an RGB image (h, w, 3), 0 to 1."""
    smooth = cv2.GaussianBlur(colour, (0, 0), 1.0).astype(np.float32)
    across, down = cv2.Sobel(smooth, cv2.CV_32F, 1, 0), cv2.Sobel(smooth, cv2.CV_32F, 0, 1)
    strength = np.sqrt((across**2 + down**2).sum(axis=2))
    return np.minimum(strength / max(float(np.percentile(strength, 95)), 1.0), 1).astype(np.float32)


def _correlation(of_depth: Edges, of_colour: Edges) -> Array:
    """Return the circular correlation (h, w) of two edge images, by shift (down, right)."""
    a = cv2.GaussianBlur(of_depth, (0, 0), _BLUR)
    b = of_colour - of_colour.mean()
    return np.asarray(np.fft.irfft2(np.conj(np.fft.rfft2(a)) * np.fft.rfft2(b), s=a.shape), dtype=np.float64)


def best_shift(correlation: Array) -> ColourShift:
    """Return the shift of the largest correlation (h, w) within reach."""
    height, width = correlation.shape
    reach = max(1, round(_FARTHEST * width))
    rows, columns = (np.minimum(np.arange(side), side - np.arange(side)) for side in (height, width))
    inside = (rows[:, None] <= reach) & (columns[None, :] <= reach)
    row, column = np.unravel_index(np.argmax(np.where(inside, correlation, -np.inf)), correlation.shape)
    down = float(row if row <= height // 2 else row - height)
    right = float(column if column <= width // 2 else column - width)
    without = float(correlation[0, 0])
    best = float(correlation[row, column])
    gain = best / without if without > 0 else np.inf
    return ColourShift((right, down), gain)


def _colour(frame: Frame) -> Image:
    assert frame.colour is not None
    return frame.colour
