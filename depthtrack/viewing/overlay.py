"""Overlays on images: masks as a tint with a contour, hands as a coloured skeleton."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import ArrayLike

from depthtrack.geometry.camera import Camera
from depthtrack.hand.kinematics import KEYPOINT_NAMES
from depthtrack.hand.pose import FINGERS
from depthtrack.types import Array, Image, Mask
from depthtrack.viewing.theme import FINGER_COLOURS, HIDDEN, OUTLINE, PALM, TRUE_MASK, Rgb

Bone = tuple[int, int]

_BASES = [KEYPOINT_NAMES.index(f"{finger}_{'cmc' if finger == 'thumb' else 'mcp'}") for finger in FINGERS]
PALM_BONES: tuple[Bone, ...] = (
    (0, _BASES[0]),
    (0, _BASES[1]),
    *((_BASES[f], _BASES[f + 1]) for f in (1, 2, 3)),
    (0, _BASES[4]),
)
"""The outline of the palm, as pairs of keypoints."""

FINGER_BONES: dict[str, tuple[Bone, ...]] = {
    finger: tuple((base + k, base + k + 1) for k in range(3)) for finger, base in zip(FINGERS, _BASES, strict=True)
}
"""The three bones of each finger, from the palm outward, as pairs of keypoints."""

BONE_BREADTH = 0.0018
"""Width of a bone, metres; narrow enough to separate neighbouring fingers."""

_SUBPIXEL_BITS = 4
_FARTHEST_PIXEL = 1 << 20


def overlay_mask(image: Image, mask: Mask, colour: Rgb = TRUE_MASK, opacity: float = 0.4) -> Image:
    """Tint an image (h, w, 3) inside a mask (h, w) and draw the mask's inner contour."""
    out = image.copy()
    out[mask] = np.rint(image[mask] * (1 - opacity) + np.array(colour, dtype=np.float32) * opacity)
    out[_inner_contour(mask, width=_line_width(image))] = colour
    return out


def spotlight(image: Image, mask: Mask, brightness: float = 0.25) -> Image:
    """Dim an image (h, w, 3) outside a mask (h, w)."""
    return np.where(mask[..., None], image, dimmed(image, brightness))


def dimmed(image: Image, brightness: float = 0.45) -> Image:
    """Darken and desaturate an image (h, w, 3), as a background for overlays."""
    grey = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)[..., None]
    return np.rint((0.35 * image + 0.65 * grey) * brightness).astype(np.uint8)


def draw_skeleton(
    image: Image,
    camera: Camera,
    keypoints: ArrayLike,
    thickness: int | None = None,
    colours: dict[str, Rgb] | None = None,
) -> Image:
    """Draw the skeleton of a hand, one colour per finger; nearer bones cover farther ones.

    Bones with a keypoint that is not finite or behind the camera are omitted.

    camera: the camera of the image, resized and cropped with it.
    keypoints (21, 3): metres, camera frame.
    thickness: pixels; None to scale with the hand's distance.
    colours: by finger and "palm"; they replace the theme's.
    Raises: ValueError if the keypoints have another shape.
    """
    points = np.asarray(keypoints, dtype=np.float64)
    if points.shape != (len(KEYPOINT_NAMES), 3):
        raise ValueError(f"keypoints must have shape ({len(KEYPOINT_NAMES)}, 3), found {points.shape}")
    palette = {"palm": PALM, **FINGER_COLOURS, **(colours or {})}
    pixels = camera.project(points)
    out = np.ascontiguousarray(image).copy()
    visible = np.isfinite(pixels.sum(axis=-1))
    thickness = _bone_thickness(image, camera, points[visible, 2]) if thickness is None else thickness
    for (a, b), part in _far_to_near(points, visible):
        _draw_bone(out, pixels[a], pixels[b], palette[part], thickness)
    return out


def faded_fingers(visibility: Sequence[float]) -> dict[str, Rgb]:
    """Return the colours of the fingers, the greyer the less of a finger is visible.

    visibility: (5,) shares, 0 to 1; NaN counts as visible.
    """
    shares = np.nan_to_num(np.asarray(visibility, dtype=np.float64), nan=1.0)
    colours = {}
    for finger, share in zip(FINGERS, shares, strict=True):
        r, g, b = (round(share * c + (1 - share) * h) for c, h in zip(FINGER_COLOURS[finger], HIDDEN, strict=True))
        colours[finger] = (r, g, b)
    return colours


def _far_to_near(points: Array, visible: Mask) -> list[tuple[Bone, str]]:
    """Return bones with both ends visible and the name of their colour, the farthest first."""
    bones = [(bone, "palm") for bone in PALM_BONES]
    bones += [(bone, finger) for finger, chain in FINGER_BONES.items() for bone in chain]
    drawn = [((a, b), part) for (a, b), part in bones if visible[a] and visible[b]]
    return sorted(drawn, key=lambda entry: -float(points[list(entry[0]), 2].sum()))


def _draw_bone(image: Image, start: Array, end: Array, colour: Rgb, thickness: int) -> None:
    """Draw a line with a dark rim and dots at its ends, in place."""
    a, b = _fixed_point(start), _fixed_point(end)
    rim = max(1, thickness // 2)
    radius = round(0.9 * thickness * (1 << _SUBPIXEL_BITS))
    cv2.line(image, a, b, OUTLINE, thickness + 2 * rim, cv2.LINE_AA, _SUBPIXEL_BITS)
    cv2.line(image, a, b, colour, thickness, cv2.LINE_AA, _SUBPIXEL_BITS)
    for centre in (a, b):
        cv2.circle(image, centre, radius + (rim << _SUBPIXEL_BITS), OUTLINE, -1, cv2.LINE_AA, _SUBPIXEL_BITS)
        cv2.circle(image, centre, radius, colour, -1, cv2.LINE_AA, _SUBPIXEL_BITS)


def _fixed_point(pixel: Array) -> tuple[int, int]:
    """Convert a pixel position to OpenCV's fixed point, clipped against overflow."""
    x, y = np.rint(np.clip(pixel, -_FARTHEST_PIXEL, _FARTHEST_PIXEL) * (1 << _SUBPIXEL_BITS)).astype(int)
    return int(x), int(y)


def _inner_contour(mask: Mask, width: int) -> Mask:
    """Return the pixels of a mask within `width` of its edge; the image's border is no edge."""
    element = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * width + 1, 2 * width + 1))
    inner = cv2.erode(mask.astype(np.uint8), element, borderType=cv2.BORDER_CONSTANT, borderValue=1)
    return mask & (inner == 0)


def _bone_thickness(image: Image, camera: Camera, depths: Array) -> int:
    """Return the projected BONE_BREADTH in pixels, within readable limits for the image's size."""
    thinnest = _line_width(image)
    apparent = BONE_BREADTH * camera.fx / float(np.median(depths)) if len(depths) else 0.0
    return round(min(max(apparent, thinnest), 3 * thinnest))


def _line_width(image: Image) -> int:
    """Return a line width in pixels that is proportional to the image's height."""
    return max(1, round(image.shape[0] / 160))
