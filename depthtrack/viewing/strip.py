"""Picture strips: a few frames of a recording as colour, depth, segmentation and skeleton."""

from collections.abc import Iterable, Sequence

import numpy as np

from depthtrack.errors import InputError
from depthtrack.geometry.rectangle import Rect
from depthtrack.types import Image
from depthtrack.viewing.annotated_frame import AnnotatedFrame
from depthtrack.viewing.depth_colours import depth_range
from depthtrack.viewing.panels import Layer, beside, blank, draw_layer, mask_colour, smaller, stacked
from depthtrack.viewing.text import put_text, text_width
from depthtrack.viewing.theme import FAINT_TEXT, Rgb

ROWS: tuple[Layer, ...] = ("colour", "depth", "hand", "skeleton")
LABEL_WIDTH = 30
GAP = 4
SMALLEST_SIDE = 32
"""Smallest side of a picture, pixels."""


def strip(frames: Iterable[AnnotatedFrame], width: int = 1600) -> Image:
    """Return a strip of close-ups: one column per frame, one row per layer.

    All regions have one size, so that hand sizes are comparable. Rows without data are omitted.

    width: of the strip, pixels.
    Result (h, w, 3): RGB.
    Raises: InputError if there are no frames, or more than fit.
    """
    frames = list(frames)
    if not frames:
        raise InputError("a picture strip needs at least one readable frame, found none")
    close = _close_on_the_hand(frames)
    near, far = _hand_depth_range(close)
    side = (width - LABEL_WIDTH) // len(close) - GAP
    if side < SMALLEST_SIDE:
        most = (width - LABEL_WIDTH) // (SMALLEST_SIDE + GAP)
        raise InputError(f"a picture strip has room for {most} frames, found {len(close)}: choose fewer")
    rows = []
    for layer in (layer for layer in ROWS if _has(close, layer)):
        pictures = [smaller(draw_layer(annotated, layer, 2 * side, near, far), side, side) for annotated in close]
        rows.append(beside([_label(*_name(close, layer), side), *pictures], GAP))
    return stacked(rows, GAP)


def _has(frames: Sequence[AnnotatedFrame], layer: Layer) -> bool:
    match layer:
        case "colour":
            return any(annotated.frame.colour is not None for annotated in frames)
        case "hand":
            return any(annotated.mask is not None for annotated in frames)
        case "skeleton":
            return any(annotated.keypoints is not None for annotated in frames)
    return True


def _close_on_the_hand(frames: Sequence[AnnotatedFrame]) -> list[AnnotatedFrame]:
    """Crop square regions of one size around the hand, or the image's centre if it is unknown."""
    boxes = [annotated.hand_box() for annotated in frames]
    extents = [max(box.shape) for box in boxes if box is not None]
    smallest = min(frames[0].camera.shape)
    side = min(round(1.2 * max(extents)), smallest) if extents else smallest
    out = []
    for annotated, box in zip(frames, boxes, strict=True):
        left, top, right, bottom = box or annotated.camera.rect
        out.append(annotated.cropped(Rect.of_size((left + right - side) // 2, (top + bottom - side) // 2, side, side)))
    return out


def _hand_depth_range(frames: Sequence[AnnotatedFrame]) -> tuple[float, float]:
    """Return near and far (metres) of the hand, or of the frames without silhouettes."""
    hands = [annotated.frame.depth[annotated.mask] for annotated in frames if annotated.mask is not None]
    if not hands:
        return depth_range(np.stack([annotated.frame.depth for annotated in frames]))
    near, far = depth_range(np.concatenate(hands))
    return near, far + 0.25 * (far - near)


def _name(frames: Sequence[AnnotatedFrame], layer: Layer) -> tuple[str, Rgb]:
    """Return the name of a row and its colour."""
    if layer != "hand":
        return layer, FAINT_TEXT
    masked = [annotated for annotated in frames if annotated.mask is not None]
    return ("hand" if masked[0].mask_is_true else "hand, estimated"), mask_colour(masked[0])


def _label(name: str, colour: Rgb, height: int) -> Image:
    """Return the name of a row as vertical text."""
    bar = blank(height, LABEL_WIDTH)
    put_text(bar, name, ((height - text_width(name, 16)) // 2, LABEL_WIDTH // 2), 16, colour)
    return np.ascontiguousarray(np.rot90(bar))
