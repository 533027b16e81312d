"""What surrounds the hand: readings that are not its own, such as the forearm's.

They hide the hand where they lie before it. A forearm that comes nearer than the range of the sensor has no readings,
but it hides the hand all the same. Its colour shows it, unless the gap may be a shadow: sensors with a projector have
no readings beside a near surface, where the projector does not reach the one behind it.
"""

from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from depthtrack.compilation import compiled
from depthtrack.geometry.rectangle import Rect
from depthtrack.recording.sequence import Frame
from depthtrack.segmentation.masks import HandMasks
from depthtrack.segmentation.morphology import dilated, eroded
from depthtrack.segmentation.skin_adaptation import AdaptiveSkin
from depthtrack.types import Depth, Image, Mask

Pixel = TypeVar("Pixel", bound=np.generic)
TOO_NEAR = np.float32(0.05)
"""Metres: depth given to skin that is too near for a reading; no sensor measures there."""
_LEAST_WIDTH = 0.012
"""Metres at the hand's distance: narrower skin without readings is an error of the hand's outline."""
_SAMPLES = 4
"""Samples across the least width."""
_BASELINE = 0.1
"""Metres between camera and projector, at most; that of the first Kinect is 0.075."""
_LEAST_SHARE = 0.5
"""Least share of a gap that is no shadow."""
_MOST_BORDER = 0.4
"""Largest share of the region's border that a forearm takes: a wall out of range takes more."""
_AROUND = 0.1
"""Metres around the hand's region in which gaps are judged."""


def surroundings_of(frame: Frame, masks: HandMasks, skin: AdaptiveSkin | None, distance: float) -> Depth:
    """Return the depth (h, w) of what is not the hand in its region, metres, 0 = nothing known.

    masks: of the hand; the result covers their region.
    skin: skin colours; None without colour.
    distance: of the hand, metres.
    """
    found = np.where(masks.silhouette, np.float32(0), frame.depth[masks.region.slices])
    if skin is None or frame.colour is None:
        return found
    width = _LEAST_WIDTH * frame.camera.fx / distance
    missing = ~((found > 0) | masks.silhouette)
    stride = max(1, round(width / _SAMPLES))
    gaps = _every(missing, stride)
    if not (_wide(gaps).any() and _wide_skin(frame.colour, masks.region, gaps, skin, stride).any()):
        return found
    region = masks.region.grown(round(_AROUND / _LEAST_WIDTH * width)).clipped(frame.camera.rect)
    if not (near := _skin_too_near(frame.depth, frame.colour, region, skin, stride, frame.camera.fx)).any():
        return found
    rows = (np.arange(masks.region.top, masks.region.bottom) - region.top) // stride
    columns = (np.arange(masks.region.left, masks.region.right) - region.left) // stride
    found[near[rows].take(columns, axis=1) & missing] = TOO_NEAR
    return found


def _skin_too_near(
    depth: Depth, colour: Image, region: Rect, skin: AdaptiveSkin, stride: int, focal_length: float
) -> Mask:
    """Return wide gaps of skin colour that are no shadows, in samples of a region.

    Every n-th row and column is sampled.

    depth, colour: (H, W) metres and (H, W, 3) RGB of the frame.
    stride: n.
    """
    readings = _every(depth[region.slices], stride)
    wide = _wide_skin(colour, region, ~(readings > 0), skin, stride)
    shadows = np.empty(wide.shape, np.bool_)
    mark_shadows(readings, float(focal_length) / stride * _BASELINE, shadows)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(wide.view(np.uint8), connectivity=4)
    lit = np.bincount(labels[wide & ~shadows], minlength=count)
    near = lit >= _LEAST_SHARE * stats[:, cv2.CC_STAT_AREA]
    border = np.concatenate([labels[0], labels[-1], labels[1:-1, 0], labels[1:-1, -1]])
    near &= np.bincount(border, minlength=count) <= _MOST_BORDER * len(border)
    near[0] = False
    return dilated(near[labels], _SAMPLES // 2 + 1) if near.any() else np.zeros_like(wide)


def _wide_skin(colour: Image, region: Rect, gaps: Mask, skin: AdaptiveSkin, stride: int) -> Mask:
    """Return the samples (h, w) of a region that lie in wide gaps of skin colour.

    gaps: (h, w) samples without a reading.
    """
    sampled = _every(colour[region.slices], stride)
    return _wide(skin.find_among(sampled, Rect.of_image(gaps.shape), gaps))


def _every(image: NDArray[Pixel], stride: int) -> NDArray[Pixel]:
    return np.ascontiguousarray(image[::stride, ::stride])


def _wide(mask: Mask) -> Mask:
    """Return the samples (h, w) of a mask that are half the least width from its complement."""
    return eroded(mask, _SAMPLES // 2)


@compiled(nogil=True)
def mark_shadows(depth: Depth, focal_baseline: float, out: Mask) -> None:
    """Mark the pixels without a reading that may lie in the shadow of a surface in their row.

    depth: (h, w) metres, 0 = no reading.
    focal_baseline: focal length times baseline of the sensor, pixels times metres.
    out: (h, w) written.

    A projector beside the camera shifts a shadow by the difference of disparities, to either side.
    """
    width = depth.shape[1]
    for v in range(depth.shape[0]):
        out[v] = False
        for side in range(2):
            step, u = (1, 0) if side == 0 else (-1, width - 1)
            # Along the row: the largest sum of place and disparity of a surface, and the last surface.
            farthest, last = -np.inf, np.inf
            while 0 <= u < width:
                if depth[v, u] > 0:
                    last = depth[v, u]
                    farthest = max(farthest, step * u + focal_baseline / last)
                    u += step
                    continue
                end = u
                while 0 <= end < width and not depth[v, end] > 0:
                    end += step
                behind = max(last, depth[v, end]) if 0 <= end < width else np.inf
                while u != end:
                    if step * u <= farthest - focal_baseline / behind:
                        out[v, u] = True
                    u += step
