"""A recording on one page: moments chosen evenly, each with depth and colour, under a title and over a legend."""

from collections.abc import Iterable
from pathlib import Path

import cv2
import numpy as np

from depthtrack.errors import InputError
from depthtrack.files import write_atomic
from depthtrack.recording.sequence import Sequence
from depthtrack.types import Image
from depthtrack.viewing.annotated_frame import AnnotatedFrame
from depthtrack.viewing.depth_colours import colour_scale
from depthtrack.viewing.panels import Layer, beside, blank, captioned, paint, smaller, stacked, tile_grid
from depthtrack.viewing.text import put_text, text_width
from depthtrack.viewing.theme import ESTIMATED_MASK, FAINT_TEXT, FINGER_COLOURS, TEXT, TRUE_MASK, Rgb

MARGIN = 20
PICTURE_SETTINGS = {".png": (cv2.IMWRITE_PNG_COMPRESSION, 6), ".jpg": (cv2.IMWRITE_JPEG_QUALITY, 92)}


def contact_sheet(
    moments: Iterable[AnnotatedFrame], title: str, subtitle: str, near: float, far: float, width: int = 1700
) -> Image:
    """A page (h, w, 3) of moments in reading order, about `width` pixels wide: depth beside an overview in colour.

    Silhouettes and true keypoints are drawn where they are known. Raises InputError without any moment to show.
    """
    moments = list(moments)
    if not moments:
        raise InputError(f"{title} holds no readable frame to show")
    # Pairs of pictures stand three in a row, single ones four.
    columns = min(4 if moments[0].frame.colour is None else 3, len(moments))
    tiles = [_tile(moment, _tile_height(moments[0], width // columns), near, far) for moment in moments]
    grid = tile_grid(tiles, columns)
    parts = [_title(title, subtitle, grid.shape[1]), grid, _legend(moments, near, far, grid.shape[1])]
    return framed(stacked(parts, gap=12))


def framed(image: Image, margin: int = MARGIN) -> Image:
    """`image` with a margin of background all around."""
    out = blank(image.shape[1] + 2 * margin, image.shape[0] + 2 * margin)
    out[margin:-margin, margin:-margin] = image
    return out


def describe(sequence: Sequence) -> str:
    """Length, duration, rate and size in one line."""
    times, camera, rate = sequence.timestamps, sequence.camera, frame_rate(sequence)
    span = [] if rate is None else [f"{times[-1] - times[0]:.1f} s", f"{rate:.0f} Hz"]
    return "  ·  ".join([f"{len(sequence)} frames", *span, f"{camera.width} x {camera.height}"])


def frame_rate(sequence: Sequence) -> float | None:
    """Frames a second by the usual interval; None for a single frame."""
    times = sequence.timestamps
    return float(1 / np.median(np.diff(times))) if len(times) > 1 else None


def save_picture(image: Image, path: Path) -> None:
    """Write an RGB image (h, w, 3) uint8 as .png or .jpg.

    Raises: InputError if the suffix is another one or the file cannot be written.
    """
    settings = PICTURE_SETTINGS.get(path.suffix.lower())
    if settings is None:
        raise InputError(f"a picture must end in {' or '.join(PICTURE_SETTINGS)}, found '{path.name}'")
    ok, data = cv2.imencode(path.suffix.lower(), np.ascontiguousarray(image[..., ::-1]), settings)
    if not ok:
        raise InputError(f"OpenCV cannot encode a picture of {image.shape[1]} x {image.shape[0]} pixels")
    write_atomic(path, data.tobytes())


def _tile(moment: AnnotatedFrame, height: int, near: float, far: float) -> Image:
    """Depth and overview; without colour the overview is drawn on the depth itself."""
    layers: list[Layer] = ["overview"] if moment.frame.colour is None else ["depth", "overview"]
    large = [paint(moment, layer, 2 * height, near, far) for layer in layers]
    pictures = [smaller(image, image.shape[1] // 2, height) for image in large]
    return captioned(beside(pictures, gap=0), f"frame {moment.frame.index}", f"{moment.frame.timestamp:.2f} s")


def _tile_height(moment: AnnotatedFrame, tile_width: int) -> int:
    pictures = 1 if moment.frame.colour is None else 2
    return max(16, round(tile_width / pictures * moment.camera.height / moment.camera.width))


def _title(title: str, subtitle: str, width: int) -> Image:
    bar = blank(width, 34)
    put_text(bar, title, (0, 17), 24)
    start = text_width(title, 24) + 18
    if start + text_width(subtitle, 14) <= width:
        put_text(bar, subtitle, (start, 19), 14, FAINT_TEXT)
    return bar


def _legend(moments: list[AnnotatedFrame], near: float, far: float, width: int) -> Image:
    """The depth scale and the meaning of the colours that occur, left to right as far as there is room."""
    bar = blank(width, 22)
    x = _write(bar, 0, f"{near:.2f} m", FAINT_TEXT) + 8
    scale = colour_scale(min(160, max(1, width - x)), 10)
    bar[6:16, x : x + scale.shape[1]] = scale[:, : max(0, width - x)]
    x = _write(bar, x + scale.shape[1] + 8, f"{far:.2f} m", FAINT_TEXT) + 28
    masks = {moment.mask_is_true for moment in moments if moment.mask is not None}
    entries: list[tuple[str, Rgb]] = []
    if True in masks:
        entries.append(("true mask", TRUE_MASK))
    if False in masks:
        entries.append(("estimated mask", ESTIMATED_MASK))
    if any(moment.keypoints is not None for moment in moments):
        entries += FINGER_COLOURS.items()
    for name, colour in entries:
        if x + 16 + text_width(name, 13) > width:
            break
        bar[6:16, x : x + 10] = colour
        x = _write(bar, x + 16, name, TEXT) + 20
    return bar


def _write(bar: Image, x: int, text: str, colour: Rgb) -> int:
    """Write `text` at `x`; returns where it ends."""
    put_text(bar, text, (x, bar.shape[0] // 2), 13, colour)
    return x + text_width(text, 13)
