"""Objects that may hide the hand: readings that belong neither to hand nor to forearm.

With colour, an object is what is within the hand's reach, before the wrist, and not skin. Surfaces that continue beyond
the reach, such as walls and tables, are left out. So are parts as small or as thin as errors of the hand's outline.
Without colour an object in the hand is connected to it, and belongs to the hand.
"""

import cv2
import numpy as np

from depthtrack.recording.sequence import Frame
from depthtrack.segmentation.continuing_surfaces import READING, without_continuing_surfaces
from depthtrack.segmentation.hand_size import HandSize
from depthtrack.segmentation.masks import HandMasks
from depthtrack.segmentation.morphology import disc
from depthtrack.segmentation.options import OccluderOptions
from depthtrack.segmentation.roi_tracking import mark_reachable
from depthtrack.segmentation.wrist import WristPlane
from depthtrack.types import Array, Depth, Mask


def find_occluder(
    frame: Frame, masks: HandMasks, centre: Array, wrist: WristPlane | None, hand: HandSize, options: OccluderOptions
) -> Depth | None:
    """Return the depth (h, w) of objects, metres, 0 elsewhere; None without any.

    masks: of the hand; the result covers their region.
    centre: (3,) of the palm on the visible surface, metres, camera frame.
    wrist: plane beyond which the forearm begins; None without a visible one.
    """
    camera, reach = frame.camera, hand.reach + options.reach_margin
    region = camera.rect_around(centre, reach)
    depth = np.ascontiguousarray(frame.depth[region.slices])
    lens = (camera.fx, camera.fy, camera.cx - region.left, camera.cy - region.top)
    # A plane without a direction has no point beyond it.
    plane = (wrist.point, wrist.normal) if wrist is not None else (centre, np.zeros(3))
    kinds = np.empty(depth.shape, dtype=np.uint8)
    mark_reachable(depth, lens, centre, reach, *plane, kinds)
    own = masks.region.paste(masks.silhouette | masks.readings, camera.rect)[region.slices]
    readings = (kinds == READING) & ~own
    if np.count_nonzero(readings) * (float(centre[2]) / camera.fx) ** 2 < options.least_area:
        return None
    readings = without_continuing_surfaces(depth, kinds, readings, camera.fx, options.max_jump, options.border_share)
    thick = _thick_parts(readings, float(centre[2]) / camera.fx, options)
    if not thick.any():
        return None
    found = _over_missing_readings(np.where(thick, depth, np.float32(0)), depth, round(options.gap * camera.width))
    found[own] = 0
    return masks.region.crop(region.paste(found, camera.rect))


def _thick_parts(mask: Mask, pixel: float, options: OccluderOptions) -> Mask:
    """Return the parts of a mask (h, w) that are neither thin nor small.

    pixel: its side, metres.
    """
    radius = max(1, round(options.least_breadth / 2 / pixel))
    opened = cv2.morphologyEx(mask.view(np.uint8), cv2.MORPH_OPEN, disc(radius))
    _, labels, statistics, _ = cv2.connectedComponentsWithStats(opened, connectivity=8)
    large = statistics[:, cv2.CC_STAT_AREA] * pixel**2 >= options.least_area
    large[0] = False
    return np.asarray(large[labels])


def _over_missing_readings(found: Depth, depth: Depth, radius: int) -> Depth:
    """Return objects (h, w) extended by up to `radius` pixels over missing readings.

    Sensors lose readings along the outlines of an object, in its shadow.
    """
    farthest = cv2.dilate(found, disc(max(radius, 1)))
    return np.asarray(np.where((found == 0) & (depth == 0), farthest, found), dtype=np.float32)
