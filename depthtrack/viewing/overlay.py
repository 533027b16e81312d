"""Marks on an image: masks as a tint with a contour, hands as a coloured skeleton. All return new images."""

import cv2
import numpy as np
from numpy.typing import ArrayLike

from depthtrack.geometry.camera import Camera
from depthtrack.hand.kinematics import KEYPOINT_NAMES
from depthtrack.hand.pose import FINGERS
from depthtrack.types import Array, Image, Mask
from depthtrack.viewing.theme import FINGER_COLOURS, OUTLINE, PALM, TRUE_MASK, Rgb

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
"""Metres; slim enough that neighbouring fingers stay apart."""

_SUBPIXEL_BITS = 4
_FARTHEST_PIXEL = 1 << 20


def overlay_mask(image: Image, mask: Mask, colour: Rgb = TRUE_MASK, opacity: float = 0.4) -> Image:
    """`image` (h, w, 3) tinted where `mask` (h, w) is set, with a solid contour just inside it."""
    out = image.copy()
    out[mask] = np.rint(image[mask] * (1 - opacity) + np.array(colour, dtype=np.float32) * opacity)
    out[_inner_contour(mask, width=_line_width(image))] = colour
    return out


def spotlight(image: Image, mask: Mask, brightness: float = 0.25) -> Image:
    """`image` (h, w, 3) as it is inside `mask` (h, w), grey and dimmed outside."""
    return np.where(mask[..., None], image, dimmed(image, brightness))


def dimmed(image: Image, brightness: float = 0.45) -> Image:
    """`image` (h, w, 3) in darker, paler colours, as a ground for bright marks."""
    grey = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)[..., None]
    return np.rint((0.35 * image + 0.65 * grey) * brightness).astype(np.uint8)


def draw_skeleton(
    image: Image,
    camera: Camera,
    keypoints: ArrayLike,
    thickness: int | None = None,
    colours: dict[str, Rgb] | None = None,
) -> Image:
    """`image` with the 21 keypoints (21, 3), metres in the camera frame, as bones and joints, a colour per finger.

    `camera` is the image's own (resized and cropped with it). Nearer bones cover farther ones. Keypoints that are
    not finite or not in front of the camera are left out with their bones. `thickness` in pixels follows the hand's
    distance unless given; `colours` by finger, and "palm", replace the theme's.
    """
    points = np.asarray(keypoints, dtype=np.float64)
    if points.shape != (len(KEYPOINT_NAMES), 3):
        raise ValueError(f"keypoints must have shape ({len(KEYPOINT_NAMES)}, 3), found {points.shape}")
    palette = {"palm": PALM, **FINGER_COLOURS, **(colours or {})}
    pixels = camera.project(points)
    out = np.ascontiguousarray(image).copy()
    seen = np.isfinite(pixels.sum(axis=-1))
    thickness = _bone_thickness(image, camera, points[seen, 2]) if thickness is None else thickness
    for (a, b), part in _far_to_near(points, seen):
        _draw_bone(out, pixels[a], pixels[b], palette[part], thickness)
    return out


def _far_to_near(points: Array, seen: Mask) -> list[tuple[Bone, str]]:
    """Bones with both ends seen, and the part whose colour they take; the farthest first."""
    bones = [(bone, "palm") for bone in PALM_BONES]
    bones += [(bone, finger) for finger, chain in FINGER_BONES.items() for bone in chain]
    visible = [((a, b), part) for (a, b), part in bones if seen[a] and seen[b]]
    return sorted(visible, key=lambda entry: -float(points[list(entry[0]), 2].sum()))


def _draw_bone(image: Image, start: Array, end: Array, colour: Rgb, thickness: int) -> None:
    """A line with a dark rim and a dot at both ends, in place."""
    a, b = _fixed_point(start), _fixed_point(end)
    rim = max(1, thickness // 2)
    radius = round(0.9 * thickness * (1 << _SUBPIXEL_BITS))
    cv2.line(image, a, b, OUTLINE, thickness + 2 * rim, cv2.LINE_AA, _SUBPIXEL_BITS)
    cv2.line(image, a, b, colour, thickness, cv2.LINE_AA, _SUBPIXEL_BITS)
    for centre in (a, b):
        cv2.circle(image, centre, radius + (rim << _SUBPIXEL_BITS), OUTLINE, -1, cv2.LINE_AA, _SUBPIXEL_BITS)
        cv2.circle(image, centre, radius, colour, -1, cv2.LINE_AA, _SUBPIXEL_BITS)


def _fixed_point(pixel: Array) -> tuple[int, int]:
    """OpenCV's fixed-point coordinates; far outside the image they are held back from overflowing."""
    x, y = np.rint(np.clip(pixel, -_FARTHEST_PIXEL, _FARTHEST_PIXEL) * (1 << _SUBPIXEL_BITS)).astype(int)
    return int(x), int(y)


def _inner_contour(mask: Mask, width: int) -> Mask:
    """Pixels of `mask` within `width` of its edge; the image's border is no edge."""
    element = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * width + 1, 2 * width + 1))
    inner = cv2.erode(mask.astype(np.uint8), element, borderType=cv2.BORDER_CONSTANT, borderValue=1)
    return mask & (inner == 0)


def _bone_thickness(image: Image, camera: Camera, depths: Array) -> int:
    """Pixels that BONE_BREADTH takes at the hand's distance, within what the image's size makes readable."""
    thinnest = _line_width(image)
    apparent = BONE_BREADTH * camera.fx / float(np.median(depths)) if len(depths) else 0.0
    return round(min(max(apparent, thinnest), 3 * thinnest))


def _line_width(image: Image) -> int:
    """Pixels; a line that looks the same at any resolution."""
    return max(1, round(image.shape[0] / 160))
