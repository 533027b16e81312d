"""Objects that may hide the hand: readings that belong neither to hand nor to forearm.

With colour, an object is what is within the hand's reach, before the wrist, and not skin. Surfaces that continue beyond
the reach, such as walls and tables, are left out. So are parts as small or as thin as errors of the hand's outline.
Without colour an object in the hand is connected to it, and belongs to the hand.
"""

import math

import cv2
import numpy as np

from depthtrack.recording.sequence import Frame
from depthtrack.segmentation.continuing_surfaces import READING, without_continuing_surfaces
from depthtrack.segmentation.hand_size import HandSize
from depthtrack.segmentation.masks import HandMasks
from depthtrack.segmentation.morphology import disc, eroded
from depthtrack.segmentation.options import OccluderOptions
from depthtrack.segmentation.roi_tracking import mark_reachable
from depthtrack.segmentation.wrist import WristPlane
from depthtrack.types import Array, Depth, Mask


def find_occluder(
    frame: Frame, masks: HandMasks, centre: Array, wrist: WristPlane | None, hand: HandSize, options: OccluderOptions
) -> Depth | None:
    """Return the depth (h, w) up to which objects are solid, metres; None without objects.

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
    pixel = float(centre[2]) / camera.fx
    parts = _thick_parts(readings, pixel, options)
    if not parts:
        return None
    found = np.zeros_like(depth)
    for part in parts:
        found[part] = solid_depth(depth, part, pixel)[part]
    found = _over_missing_readings(found, depth, round(options.gap * camera.width))
    found[own] = 0
    return masks.region.crop(region.paste(found, camera.rect))


def solid_depth(depth: Depth, part: Mask, pixel: float) -> Depth:
    """Return the depth (h, w) up to which an object is solid at least, metres.

    depth: (h, w) metres.
    part: (h, w) its pixels.
    pixel: side of one, metres.

    A convex object contains what lies between its visible surface and the plane through its outline. A plane's inverse
    depth is linear in the pixel. Half a sphere bulges most, by its radius.
    """
    rim = part & ~eroded(part, 1)
    v, u = np.nonzero(rim if np.count_nonzero(rim) > 2 else part)
    plane, *_ = np.linalg.lstsq(np.stack([u, v, np.ones(len(u))], axis=1), 1 / depth[v, u].astype(np.float64))
    rows, columns = np.ogrid[: depth.shape[0], : depth.shape[1]]
    inverse = plane[0] * columns + plane[1] * rows + plane[2]
    radius = pixel * math.sqrt(np.count_nonzero(part) / math.pi)
    behind = np.divide(1, inverse, out=np.zeros(depth.shape), where=inverse > 0)
    return np.clip(behind, depth, depth + radius).astype(np.float32)


def _thick_parts(mask: Mask, pixel: float, options: OccluderOptions) -> list[Mask]:
    """Return the connected parts of a mask (h, w) that are neither thin nor small.

    pixel: its side, metres.
    """
    radius = max(1, round(options.least_breadth / 2 / pixel))
    opened = cv2.morphologyEx(mask.view(np.uint8), cv2.MORPH_OPEN, disc(radius))
    _, labels, statistics, _ = cv2.connectedComponentsWithStats(opened, connectivity=8)
    large = statistics[:, cv2.CC_STAT_AREA] * pixel**2 >= options.least_area
    large[0] = False
    return [labels == label for label in np.flatnonzero(large)]


def _over_missing_readings(found: Depth, depth: Depth, radius: int) -> Depth:
    """Return objects (h, w) extended by up to `radius` pixels over missing readings.

    Sensors lose readings along the outlines of an object, in its shadow.
    """
    farthest = cv2.dilate(found, disc(max(radius, 1)))
    return np.asarray(np.where((found == 0) & (depth == 0), farthest, found), dtype=np.float32)
