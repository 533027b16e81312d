"""One composed picture of a moment: depth, colour, silhouette and skeleton side by side, in equal sizes."""

from collections.abc import Iterable
from typing import Literal

import cv2
import numpy as np

from depthtrack.recording.sequence import Sequence
from depthtrack.types import Image, Mask
from depthtrack.viewing.annotated_frame import AnnotatedFrame, MaskEstimator, evenly_chosen, moments
from depthtrack.viewing.depth_colours import depth_to_rgb
from depthtrack.viewing.overlay import dimmed, draw_skeleton, overlay_mask, spotlight
from depthtrack.viewing.text import put_text, text_width
from depthtrack.viewing.theme import BACKGROUND, ESTIMATED_MASK, FAINT_TEXT, SURFACE, TEXT, TRUE_MASK, Rgb

Layer = Literal["colour", "depth", "mask", "hand", "skeleton", "overview"]

GAP = 6
CAPTION_HEIGHT = 28


def paint(moment: AnnotatedFrame, layer: Layer, height: int, near: float, far: float) -> Image:
    """One view of a moment, `height` pixels high; depth colours run from `near` to `far` (metres).

    "colour" falls back to depth where there is none. "mask" tints the silhouette, "hand" leaves only it lit,
    "skeleton" draws the true keypoints on a dimmed image, "overview" draws silhouette and keypoints on one image.
    Lines are drawn after scaling, so they are crisp at any size.
    """
    camera = moment.camera.resized(height / moment.camera.height)
    depth, colour = moment.frame.depth, moment.frame.colour
    if layer == "depth" or colour is None:
        image = _scaled(depth_to_rgb(depth, near, far), camera.width, camera.height)
    else:
        image = _scaled(colour, camera.width, camera.height)
    mask = None if moment.mask is None else _scaled_mask(moment.mask, camera.width, camera.height)
    if layer == "hand" and mask is not None:
        image = spotlight(image, mask)
    if layer in ("mask", "hand", "overview") and mask is not None:
        image = overlay_mask(image, mask, mask_colour(moment), _tint(moment, layer))
    if layer == "skeleton":
        image = dimmed(image)
    if layer in ("skeleton", "overview") and moment.keypoints is not None:
        image = draw_skeleton(image, camera, moment.keypoints)
    return image


def panel(moment: AnnotatedFrame, layers: Iterable[Layer], height: int, near: float, far: float) -> Image:
    """The layers of one moment under their names: a film's picture. Up to three stand side by side, more in two rows.

    Each is `height` pixels high without its caption; the first tells the frame's number and time.
    """
    tiles: list[Image] = []
    for layer in layers:
        name, remark, accent = _layer_caption(layer, moment)
        if not tiles:
            remark = f"frame {moment.frame.index}  ·  {moment.frame.timestamp:.2f} s"
        tiles.append(captioned(paint(moment, layer, height, near, far), name, remark, accent))
    return tile_grid(tiles, columns=len(tiles) if len(tiles) <= 3 else -(-len(tiles) // 2))


def useful_layers(sequence: Sequence, estimate: MaskEstimator | None = None) -> tuple[Layer, ...]:
    """The layers of `panel` that have something to show, judged from a few frames; the same for a whole recording."""
    sample = list(moments(sequence, evenly_chosen(len(sequence), 5)))
    shown: dict[Layer, bool] = {
        "depth": True,
        "colour": any(moment.frame.colour is not None for moment in sample),
        "mask": estimate is not None or any(moment.mask is not None for moment in sample),
        "skeleton": any(moment.keypoints is not None for moment in sample),
    }
    return tuple(layer for layer, useful in shown.items() if useful)


def mask_colour(moment: AnnotatedFrame) -> Rgb:
    """True and estimated silhouettes never look the same."""
    return TRUE_MASK if moment.mask_is_true else ESTIMATED_MASK


def beside(images: Iterable[Image], gap: int = GAP) -> Image:
    """Images of one height in a row."""
    return np.concatenate(_with_gaps(list(images), gap, axis=1), axis=1)


def stacked(images: Iterable[Image], gap: int = GAP) -> Image:
    """Images of one width in a column."""
    return np.concatenate(_with_gaps(list(images), gap, axis=0), axis=0)


def tile_grid(tiles: list[Image], columns: int, gap: int = GAP) -> Image:
    """Tiles of one size in rows of `columns`, from left to right; the last row is filled up with background."""
    height, width = tiles[0].shape[:2]
    filled = tiles + [blank(width, height)] * (-len(tiles) % columns)
    return stacked((beside(filled[i : i + columns], gap) for i in range(0, len(filled), columns)), gap)


def captioned(image: Image, left: str, right: str = "", accent: Rgb = TEXT) -> Image:
    """`image` under a bar with a name at the left and a remark at the right, where there is room for it."""
    bar = blank(image.shape[1], CAPTION_HEIGHT, SURFACE)
    put_text(bar, left, (8, CAPTION_HEIGHT // 2), 14, accent)
    remark = bar.shape[1] - 8 - text_width(right, 13)
    if right and remark > 16 + text_width(left, 14):
        put_text(bar, right, (remark, CAPTION_HEIGHT // 2), 13, FAINT_TEXT)
    return np.concatenate([bar, image])


def blank(width: int, height: int, colour: Rgb = BACKGROUND) -> Image:
    """A plain image (height, width, 3)."""
    return np.full((height, width, 3), colour, dtype=np.uint8)


def _layer_caption(layer: Layer, moment: AnnotatedFrame) -> tuple[str, str, Rgb]:
    if layer == "mask":
        if moment.mask is None:
            return "hand", "none found", FAINT_TEXT
        return ("hand, true mask" if moment.mask_is_true else "hand, estimated mask"), "", mask_colour(moment)
    if layer == "skeleton":
        return "true skeleton", "" if moment.keypoints is not None else "not annotated", TEXT
    return layer, "", TEXT


def _tint(moment: AnnotatedFrame, layer: Layer) -> float:
    """Opacity of the silhouette: a contour alone around a lit hand, and little colour under a skeleton."""
    if layer == "hand":
        return 0.0
    return 0.15 if layer == "overview" and moment.keypoints is not None else 0.4


def _with_gaps(images: list[Image], gap: int, axis: int) -> list[Image]:
    parts: list[Image] = []
    for number, image in enumerate(images):
        if number:
            shape = list(image.shape)
            shape[axis] = gap
            parts.append(np.broadcast_to(np.array(BACKGROUND, dtype=np.uint8), shape))
        parts.append(image)
    return parts


def smaller(image: Image, width: int, height: int) -> Image:
    """`image` shrunk by averaging, which smooths lines that were drawn large."""
    return cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA).astype(np.uint8, copy=False)


def _scaled(image: Image, width: int, height: int) -> Image:
    if height < image.shape[0]:
        return smaller(image, width, height)
    return cv2.resize(image, (width, height), interpolation=cv2.INTER_CUBIC).astype(np.uint8, copy=False)


def _scaled_mask(mask: Mask, width: int, height: int) -> Mask:
    method = cv2.INTER_AREA if height < mask.shape[0] else cv2.INTER_LINEAR
    return cv2.resize(mask.astype(np.float32), (width, height), interpolation=method) >= 0.5
