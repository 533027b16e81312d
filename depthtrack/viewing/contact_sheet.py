"""Contact sheets: frames of a recording on one page, with title and legend."""

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
from depthtrack.viewing.panels import Layer, beside, blank, captioned, draw_layer, smaller, stacked, tile_grid
from depthtrack.viewing.text import put_text, text_width
from depthtrack.viewing.theme import ESTIMATED_MASK, FAINT_TEXT, FINGER_COLOURS, OCCLUDER, TEXT, TRUE_MASK, Rgb

MARGIN = 20
"""Background around a page, pixels."""
PICTURE_SETTINGS = {".png": (cv2.IMWRITE_PNG_COMPRESSION, 6), ".jpg": (cv2.IMWRITE_JPEG_QUALITY, 92)}


def contact_sheet(
    frames: Iterable[AnnotatedFrame], title: str, subtitle: str, near: float, far: float, width: int = 1700
) -> Image:
    """Return a page of frames in reading order: depth, and colour with silhouette and keypoints.

    near, far: ends of the depth colours, metres.
    width: approximate width of the page, pixels.
    Result (h, w, 3): RGB.
    Raises: InputError if there are no frames.
    """
    frames = list(frames)
    if not frames:
        raise InputError(f"{title} holds no readable frame to show")
    # Pairs of pictures are placed three in a row, single ones four.
    layers: list[Layer] = ["overview"]
    if any(annotated.frame.colour is not None for annotated in frames):
        layers = ["depth", "overview"]
    columns = min(5 - len(layers), len(frames))
    height = _tile_height(frames[0], width // columns / len(layers))
    tiles = [_tile(annotated, layers, height, near, far) for annotated in frames]
    grid = tile_grid(tiles, columns)
    parts = [_title(title, subtitle, grid.shape[1]), grid, _legend(frames, near, far, grid.shape[1])]
    return framed(stacked(parts, gap=12))


def framed(image: Image, margin: int = MARGIN) -> Image:
    """Add a margin of background around an image."""
    out = blank(image.shape[1] + 2 * margin, image.shape[0] + 2 * margin)
    out[margin:-margin, margin:-margin] = image
    return out


def describe(sequence: Sequence) -> str:
    """Return length, duration, rate and image size of a recording in one line."""
    times, camera, rate = sequence.timestamps, sequence.camera, frame_rate(sequence)
    span = [] if rate is None else [f"{times[-1] - times[0]:.1f} s", f"{rate:.0f} Hz"]
    return "  ·  ".join([f"{len(sequence)} frames", *span, f"{camera.width} x {camera.height}"])


def frame_rate(sequence: Sequence) -> float | None:
    """Return the frame rate (Hz) from the median interval; None for a single frame."""
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


def _tile(annotated: AnnotatedFrame, layers: list[Layer], height: int, near: float, far: float) -> Image:
    """Return layers of a frame in a row; an overview without colour is on depth."""
    large = [draw_layer(annotated, layer, 2 * height, near, far) for layer in layers]
    pictures = [smaller(image, image.shape[1] // 2, height) for image in large]
    return captioned(beside(pictures, gap=0), f"frame {annotated.frame.index}", f"{annotated.frame.timestamp:.2f} s")


def _tile_height(annotated: AnnotatedFrame, width: float) -> int:
    """Return the height of one picture of a tile, pixels."""
    return max(16, round(width * annotated.camera.height / annotated.camera.width))


def _title(title: str, subtitle: str, width: int) -> Image:
    bar = blank(width, 34)
    put_text(bar, title, (0, 17), 24)
    start = text_width(title, 24) + 18
    if start + text_width(subtitle, 14) <= width:
        put_text(bar, subtitle, (start, 19), 14, FAINT_TEXT)
    return bar


def _legend(frames: list[AnnotatedFrame], near: float, far: float, width: int) -> Image:
    """Return the depth scale and the legend of the colours in use, cut at the page's width."""
    bar = blank(width, 22)
    x = _write(bar, 0, f"{near:.2f} m", FAINT_TEXT) + 8
    scale = colour_scale(min(160, max(1, width - x)), 10)
    bar[6:16, x : x + scale.shape[1]] = scale[:, : max(0, width - x)]
    x = _write(bar, x + scale.shape[1] + 8, f"{far:.2f} m", FAINT_TEXT) + 28
    masks = {annotated.mask_is_true for annotated in frames if annotated.mask is not None}
    entries: list[tuple[str, Rgb]] = []
    if True in masks:
        entries.append(("true mask", TRUE_MASK))
    if False in masks:
        entries.append(("estimated mask", ESTIMATED_MASK))
    if any(annotated.occluder is not None for annotated in frames):
        entries.append(("object", OCCLUDER))
    if any(annotated.keypoints is not None for annotated in frames):
        entries += FINGER_COLOURS.items()
    for name, colour in entries:
        if x + 16 + text_width(name, 13) > width:
            break
        bar[6:16, x : x + 10] = colour
        x = _write(bar, x + 16, name, TEXT) + 20
    return bar


def _write(bar: Image, x: int, text: str, colour: Rgb) -> int:
    """Write `text` at `x` and return its end."""
    put_text(bar, text, (x, bar.shape[0] // 2), 13, colour)
    return x + text_width(text, 13)
