"""The hand where a tracker expects it: no search, only what is skin and within a hand's reach, as in the paper.

Oikonomidis et al. 2011, Sec. 2.1, keep the skin-coloured points near the hand's last position. A tracker that is sure
knows more: how far from the palm a hand can reach, and where its wrist is.
"""

from dataclasses import dataclass

import cv2
import numba
import numpy as np

from depthtrack.geometry.rectangle import Rect
from depthtrack.recording.sequence import Frame
from depthtrack.segmentation.skin_adaptation import AdaptiveSkin
from depthtrack.segmentation.surface_grid import dilated, disc
from depthtrack.segmentation.wrist import WristPlane
from depthtrack.types import Array, Depth, Labels, Mask

ROI_MARGIN = 0.04
"""Metres around the hand that the region of interest leaves for hypotheses to move in."""

DILATION = 5 / 640
"""Radius of the circular dilation of skin (ibid.: 5 pixels of 640), as a share of the image's width."""

FEWEST_READINGS = 30
"""Pixels of depth below which nothing can be said of a hand."""

SMALL_PIECE = 0.02
"""Pieces smaller than this share of the largest are specks of noise, not fingers seen apart."""

PALM_HALF_THICKNESS = 0.0145
"""Metres from the palm's visible surface to its centre (see `hand.shape.HandShape.palm_thickness`)."""

_NOTHING, READING, _MISSING = 0, 1, 2


@dataclass(frozen=True)
class RoiPrior:
    """Where a hand is expected: `centre` (3,) of the palm, metres, camera frame; `reach` in metres from there to the
    farthest fingertip; the `wrist` where it ends."""

    centre: Array
    reach: float
    wrist: WristPlane


@dataclass(frozen=True)
class RoiMasks:
    """`skin` and `readings` (h, w) of the hand in a `region` of the frame."""

    region: Rect
    skin: Mask
    readings: Mask


def segment_roi(frame: Frame, place: RoiPrior, skin: AdaptiveSkin | None) -> RoiMasks | None:
    """The hand at its expected place, or None where hardly anything is there."""
    if place.centre[2] <= 0.05:
        return None
    region = frame.camera.rect_around(place.centre, place.reach)
    depth = np.ascontiguousarray(frame.depth[region.slices])
    camera = frame.camera
    lens = (camera.fx, camera.fy, camera.cx - region.left, camera.cy - region.top)
    kinds = np.empty(depth.shape, dtype=np.uint8)
    mark_reachable(depth, lens, place.centre, place.reach, place.wrist.point, place.wrist.normal, kinds)
    readings, silhouette = kinds == READING, kinds == READING
    if skin is not None and frame.colour is not None:
        found = skin.find(frame.colour, region, np.ones((1, 1), np.uint8), max(depth.shape)) > 0
        radius = max(1, round(DILATION * camera.width))
        readings &= dilated(found, radius)
        # Skin without a reading counts in gaps between readings: beyond them, shadows fall on what may look like skin.
        gaps = cv2.morphologyEx(readings.astype(np.uint8), cv2.MORPH_CLOSE, disc(radius)) > 0
        silhouette = readings | (found & gaps & (kinds == _MISSING))
    silhouette = _without_specks(silhouette)
    readings &= silhouette
    if np.count_nonzero(readings) < FEWEST_READINGS:
        return None
    roi = bounding_box(silhouette, round(ROI_MARGIN * camera.fx / float(place.centre[2])))
    return RoiMasks(roi.shifted(region.left, region.top), silhouette[roi.slices], readings[roi.slices])


def bounding_box(mask: Mask, margin: int) -> Rect:
    """Return the bounding box of a mask (h, w) with `margin` pixels around it, within the image."""
    return Rect.bounding(mask).grown(margin).clipped(Rect.of_image(mask.shape))


@numba.njit(cache=True, nogil=True)
def mark_reachable(
    depth: Depth,
    lens: tuple[float, float, float, float],
    centre: Array,
    reach: float,
    wrist: Array,
    towards_arm: Array,
    out: Labels,
) -> None:
    """READING where a point lies within `reach` of the centre and before the wrist, _MISSING where there is no
    reading but a point as far away as the centre would, into `out` (h, w)."""
    fx, fy, cx, cy = lens
    for v in range(depth.shape[0]):
        for u in range(depth.shape[1]):
            z = np.float64(depth[v, u])
            kind = READING if z > 0.0 else _MISSING
            if kind == _MISSING:
                z = centre[2]
            x, y = (u - cx) / fx * z, (v - cy) / fy * z
            dx, dy, dz = x - centre[0], y - centre[1], z - centre[2]
            beyond = (x - wrist[0]) * towards_arm[0] + (y - wrist[1]) * towards_arm[1] + (z - wrist[2]) * towards_arm[2]
            near = dx * dx + dy * dy + dz * dz < reach * reach and beyond < 0.0
            out[v, u] = kind if near else _NOTHING


def _without_specks(mask: Mask) -> Mask:
    count, labels, statistics, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    if count <= 2:
        return mask
    areas = statistics[:, cv2.CC_STAT_AREA].copy()
    areas[0] = 0
    return np.asarray((areas >= SMALL_PIECE * areas.max())[labels])
