"""Panels: depth, colour, silhouette and skeleton of a frame side by side, in equal sizes."""

from collections.abc import Iterable
from typing import Literal

import cv2
import numpy as np

from depthtrack.recording.sequence import Sequence
from depthtrack.types import Image, Mask
from depthtrack.viewing.annotated_frame import AnnotatedFrame, MaskEstimator, annotated_frames, evenly_spaced
from depthtrack.viewing.depth_colours import depth_to_rgb
from depthtrack.viewing.overlay import dimmed, draw_skeleton, overlay_mask, spotlight
from depthtrack.viewing.text import put_text, text_width
from depthtrack.viewing.theme import BACKGROUND, ESTIMATED_MASK, FAINT_TEXT, OCCLUDER, SURFACE, TEXT, TRUE_MASK, Rgb

Layer = Literal["colour", "depth", "mask", "hand", "skeleton", "overview"]
"""Kinds of pictures of a frame; see `draw_layer`."""

GAP = 6
CAPTION_HEIGHT = 28


def draw_layer(annotated: AnnotatedFrame, layer: Layer, height: int, near: float, far: float) -> Image:
    """Draw one layer of a frame, `height` pixels high.

    - "colour": the colour image, else depth.
    - "mask": a tinted silhouette; "hand": the image dimmed outside the silhouette. An object before it is tinted too.
    - "skeleton": keypoints on a dimmed image; "overview": silhouette and keypoints.

    Lines are drawn after scaling, so they are sharp at any size.

    near, far: ends of the depth colours, metres.
    Result (h, w, 3): RGB.
    """
    camera = annotated.camera.resized(height / annotated.camera.height)
    depth, colour = annotated.frame.depth, annotated.frame.colour
    if layer == "depth" or colour is None:
        image = _scaled(depth_to_rgb(depth, near, far), camera.width, camera.height)
    else:
        image = _scaled(colour, camera.width, camera.height)
    mask = None if annotated.mask is None else _scaled_mask(annotated.mask, camera.width, camera.height)
    if layer == "hand" and mask is not None:
        image = spotlight(image, mask)
    if layer in ("mask", "hand", "overview") and mask is not None:
        image = overlay_mask(image, mask, mask_colour(annotated), _tint(annotated, layer))
        image = draw_occluder(image, annotated)
    if layer == "skeleton":
        image = dimmed(image)
    if layer in ("skeleton", "overview") and annotated.keypoints is not None:
        image = draw_skeleton(image, camera, annotated.keypoints)
    return image


def draw_occluder(image: Image, annotated: AnnotatedFrame) -> Image:
    """Tint the object that may hide the hand, if any, in an image (h, w, 3) of the frame."""
    if annotated.occluder is None:
        return image
    return overlay_mask(image, _scaled_mask(annotated.occluder, image.shape[1], image.shape[0]), OCCLUDER, 0.5)


def panel(annotated: AnnotatedFrame, layers: Iterable[Layer], height: int, near: float, far: float) -> Image:
    """Draw layers of a frame with captions, for a video; more than three make two rows.

    The first caption has the frame's number and time.

    height: of each layer without its caption, pixels.
    near, far: ends of the depth colours, metres.
    Result (h, w, 3): RGB.
    """
    tiles: list[Image] = []
    for layer in layers:
        name, remark, accent = _layer_caption(layer, annotated)
        if not tiles:
            remark = f"frame {annotated.frame.index}  ·  {annotated.frame.timestamp:.2f} s"
        tiles.append(captioned(draw_layer(annotated, layer, height, near, far), name, remark, accent))
    return tile_grid(tiles, columns=len(tiles) if len(tiles) <= 3 else -(-len(tiles) // 2))


def useful_layers(sequence: Sequence, estimate: MaskEstimator | None = None) -> tuple[Layer, ...]:
    """Return the layers of `panel` that a recording has, judged by a few of its frames."""
    sample = list(annotated_frames(sequence, evenly_spaced(len(sequence), 5)))
    shown: dict[Layer, bool] = {
        "depth": True,
        "colour": any(annotated.frame.colour is not None for annotated in sample),
        "mask": estimate is not None or any(annotated.mask is not None for annotated in sample),
        "skeleton": any(annotated.keypoints is not None for annotated in sample),
    }
    return tuple(layer for layer, useful in shown.items() if useful)


def mask_colour(annotated: AnnotatedFrame) -> Rgb:
    """Return the colour of the silhouette, which differs for true and estimated ones."""
    return TRUE_MASK if annotated.mask_is_true else ESTIMATED_MASK


def beside(images: Iterable[Image], gap: int = GAP) -> Image:
    """Join images of one height in a row."""
    return np.concatenate(_with_gaps(list(images), gap, axis=1), axis=1)


def stacked(images: Iterable[Image], gap: int = GAP) -> Image:
    """Join images of one width in a column."""
    return np.concatenate(_with_gaps(list(images), gap, axis=0), axis=0)


def tile_grid(tiles: list[Image], columns: int, gap: int = GAP) -> Image:
    """Arrange tiles of one size in rows of `columns`; background fills the last row."""
    height, width = tiles[0].shape[:2]
    filled = tiles + [blank(width, height)] * (-len(tiles) % columns)
    return stacked((beside(filled[i : i + columns], gap) for i in range(0, len(filled), columns)), gap)


def captioned(image: Image, left: str, right: str = "", accent: Rgb = TEXT) -> Image:
    """Add a caption bar above an image: a name, and a remark at the right if it fits."""
    bar = blank(image.shape[1], CAPTION_HEIGHT, SURFACE)
    put_text(bar, left, (8, CAPTION_HEIGHT // 2), 14, accent)
    remark = bar.shape[1] - 8 - text_width(right, 13)
    if right and remark > 16 + text_width(left, 14):
        put_text(bar, right, (remark, CAPTION_HEIGHT // 2), 13, FAINT_TEXT)
    return np.concatenate([bar, image])


def blank(width: int, height: int, colour: Rgb = BACKGROUND) -> Image:
    """Return an image (height, width, 3) of one colour."""
    return np.full((height, width, 3), colour, dtype=np.uint8)


def _layer_caption(layer: Layer, annotated: AnnotatedFrame) -> tuple[str, str, Rgb]:
    if layer == "mask":
        if annotated.mask is None:
            return "hand", "none found", FAINT_TEXT
        remark = "" if annotated.occluder is None else "object in green"
        return ("hand, true mask" if annotated.mask_is_true else "hand, estimated mask"), remark, mask_colour(annotated)
    if layer == "skeleton":
        return "true skeleton", "" if annotated.keypoints is not None else "not annotated", TEXT
    return layer, "", TEXT


def _tint(annotated: AnnotatedFrame, layer: Layer) -> float:
    """Return the silhouette's opacity: 0 around a bright hand, low under a skeleton."""
    if layer == "hand":
        return 0.0
    return 0.15 if layer == "overview" and annotated.keypoints is not None else 0.4


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
    """Downscale an image by area averaging, which antialiases lines."""
    return cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA).astype(np.uint8, copy=False)


def _scaled(image: Image, width: int, height: int) -> Image:
    if height < image.shape[0]:
        return smaller(image, width, height)
    return cv2.resize(image, (width, height), interpolation=cv2.INTER_CUBIC).astype(np.uint8, copy=False)


def _scaled_mask(mask: Mask, width: int, height: int) -> Mask:
    method = cv2.INTER_AREA if height < mask.shape[0] else cv2.INTER_LINEAR
    return cv2.resize(mask.astype(np.float32), (width, height), interpolation=method) >= 0.5
