"""What surrounds the hand: readings that are not its own, such as the forearm's.

They hide the hand where they lie before it. A forearm that comes nearer than the range of the sensor has no readings,
but it hides the hand all the same. Its colour shows it, unless the gap may be a shadow: sensors with a projector have
no readings beside a near surface, where the projector does not reach the one behind it.
"""

import cv2
import numpy as np

from depthtrack.compilation import compiled
from depthtrack.geometry.rectangle import Rect
from depthtrack.recording.sequence import Frame
from depthtrack.segmentation.masks import HandMasks
from depthtrack.segmentation.morphology import dilated, eroded
from depthtrack.segmentation.skin_adaptation import AdaptiveSkin
from depthtrack.types import Depth, Mask

TOO_NEAR = np.float32(0.05)
"""Metres: depth given to skin that is too near for a reading; no sensor measures there."""
_LEAST_WIDTH = 0.012
"""Metres at the hand's distance: narrower skin without readings is an error of the hand's outline."""
_BASELINE = 0.1
"""Metres between camera and projector, at most; that of the first Kinect is 0.075."""
_LEAST_SHARE = 0.5
"""Least share of a gap that is no shadow."""
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
    pixels = frame.camera.fx / distance
    radius = max(1, round(_LEAST_WIDTH / 2 * pixels))
    missing = ~((found > 0) | masks.silhouette)
    if not eroded(missing, radius).any():
        return found
    region = masks.region.grown(round(_AROUND * pixels)).clipped(frame.camera.rect)
    near = _skin_too_near(frame, region, skin, radius)
    here = masks.region.shifted(-region.left, -region.top)
    found[near[here.slices] & missing] = TOO_NEAR
    return found


def _skin_too_near(frame: Frame, region: Rect, skin: AdaptiveSkin, radius: int) -> Mask:
    """Return the wide gaps (h, w) of skin colour in a region that are no shadows.

    radius: half of their least width, pixels.
    """
    assert frame.colour is not None
    missing = ~(frame.depth[region.slices] > 0)
    wide = eroded(skin.find_among(frame.colour, region, missing), radius)
    if not wide.any():
        return wide
    shadows = np.empty(missing.shape, np.bool_)
    mark_shadows(frame.depth, *map(int, region), float(frame.camera.fx) * _BASELINE, shadows)
    count, labels = cv2.connectedComponents(wide.view(np.uint8), connectivity=4)
    areas = np.bincount(labels.ravel(), minlength=count)
    near = np.bincount(labels[~shadows], minlength=count) >= _LEAST_SHARE * areas
    near[0] = False
    return dilated(near[labels], radius + 1)


@compiled(nogil=True)
def mark_shadows(depth: Depth, left: int, top: int, right: int, bottom: int, focal_baseline: float, out: Mask) -> None:
    """Mark the pixels without a reading that may lie in the shadow of a surface in their row.

    depth: (H, W) of the whole frame, metres, 0 = no reading.
    left, top, right, bottom: region of the frame.
    focal_baseline: focal length times baseline of the sensor, pixels times metres.
    out: (h, w) of the region, written.

    A projector beside the camera shifts a shadow by the difference of disparities, to either side.
    """
    width = depth.shape[1]
    for v in range(top, bottom):
        out[v - top] = False
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
                    if left <= u < right and step * u <= farthest - focal_baseline / behind:
                        out[v - top, u - left] = True
                    u += step
