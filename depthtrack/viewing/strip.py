"""A wide banner: a few moments of a recording, each seen in colour, as depth, segmented and as a skeleton."""

from collections.abc import Iterable, Sequence

import numpy as np

from depthtrack.errors import InputError
from depthtrack.geometry.rectangle import Rect
from depthtrack.types import Image
from depthtrack.viewing.annotated_frame import AnnotatedFrame
from depthtrack.viewing.depth_colours import depth_range
from depthtrack.viewing.panels import Layer, beside, blank, mask_colour, paint, smaller, stacked
from depthtrack.viewing.text import put_text, text_width
from depthtrack.viewing.theme import FAINT_TEXT, Rgb

ROWS: tuple[Layer, ...] = ("colour", "depth", "hand", "skeleton")
LABEL_WIDTH = 30
GAP = 4
SMALLEST_SIDE = 32
"""Pixels of a picture in which a hand can still be made out."""


def strip(moments: Iterable[AnnotatedFrame], width: int = 1600) -> Image:
    """A banner (h, w, 3) of `width` pixels: a column a moment, a row a view, close on the hand.

    Every moment is seen in a region of the same size, so that sizes compare. Rows with nothing to show are
    left out. Raises InputError without any moment to show, or with more than there is room for.
    """
    moments = list(moments)
    if not moments:
        raise InputError("a picture strip needs at least one readable frame")
    close = _close_on_the_hand(moments)
    near, far = _range_of_the_hand(close)
    side = (width - LABEL_WIDTH) // len(close) - GAP
    if side < SMALLEST_SIDE:
        most = (width - LABEL_WIDTH) // (SMALLEST_SIDE + GAP)
        raise InputError(f"a picture strip has room for {most} moments, found {len(close)}: choose fewer")
    rows = []
    for layer in (layer for layer in ROWS if _has(close, layer)):
        pictures = [smaller(paint(moment, layer, 2 * side, near, far), side, side) for moment in close]
        rows.append(beside([_label(*_name(close, layer), side), *pictures], GAP))
    return stacked(rows, GAP)


def _has(moments: Sequence[AnnotatedFrame], layer: Layer) -> bool:
    match layer:
        case "colour":
            return any(moment.frame.colour is not None for moment in moments)
        case "hand":
            return any(moment.mask is not None for moment in moments)
        case "skeleton":
            return any(moment.keypoints is not None for moment in moments)
    return True


def _close_on_the_hand(moments: Sequence[AnnotatedFrame]) -> list[AnnotatedFrame]:
    """Square regions of one size around the hand, or around the image's middle where no hand is known."""
    boxes = [moment.hand_box() for moment in moments]
    extents = [max(box.shape) for box in boxes if box is not None]
    smallest = min(moments[0].camera.shape)
    side = min(round(1.2 * max(extents)), smallest) if extents else smallest
    out = []
    for moment, box in zip(moments, boxes, strict=True):
        left, top, right, bottom = box or moment.camera.rect
        out.append(moment.cropped(Rect.of_size((left + right - side) // 2, (top + bottom - side) // 2, side, side)))
    return out


def _range_of_the_hand(moments: Sequence[AnnotatedFrame]) -> tuple[float, float]:
    """Near and far (metres) that give the hand most of the colours; of everything where no silhouette is known."""
    hands = [moment.frame.depth[moment.mask] for moment in moments if moment.mask is not None]
    if not hands:
        return depth_range(np.stack([moment.frame.depth for moment in moments]))
    near, far = depth_range(np.concatenate(hands))
    return near, far + 0.25 * (far - near)


def _name(moments: Sequence[AnnotatedFrame], layer: Layer) -> tuple[str, Rgb]:
    """What a row is called, and in which colour."""
    if layer != "hand":
        return layer, FAINT_TEXT
    masked = [moment for moment in moments if moment.mask is not None]
    return ("hand" if masked[0].mask_is_true else "hand, estimated"), mask_colour(masked[0])


def _label(name: str, colour: Rgb, height: int) -> Image:
    """The name of a row, written upwards."""
    bar = blank(height, LABEL_WIDTH)
    put_text(bar, name, ((height - text_width(name, 16)) // 2, LABEL_WIDTH // 2), 16, colour)
    return np.ascontiguousarray(np.rot90(bar))
