"""Segmentation near the hand that a tracker predicts, without a search.

Oikonomidis et al. 2011, Sec. 2.1, keep the skin-coloured points near the hand's last position. A trusted pose also
gives the reach of the hand and the plane of its wrist.
"""

from dataclasses import dataclass

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.recording.sequence import Frame
from depthtrack.segmentation.components import without_small_components
from depthtrack.segmentation.continuing_surfaces import (
    BEYOND_WRIST,
    MISSING,
    OUTSIDE,
    READING,
    without_continuing_surfaces,
)
from depthtrack.segmentation.hand_size import HandSize
from depthtrack.segmentation.masks import HandMasks, dilation_radius
from depthtrack.segmentation.morphology import bounding_box, closed, dilated
from depthtrack.segmentation.options import SegmentationOptions
from depthtrack.segmentation.skin_adaptation import AdaptiveSkin
from depthtrack.segmentation.wrist import WristPlane
from depthtrack.types import Array, Depth, Labels


@dataclass(frozen=True)
class RoiPrior:
    """Prior of the region of interest, from a tracker's prediction.

    centre: (3,) of the palm, metres, camera frame.
    wrist: plane where the hand ends.
    hand: sizes of the tracker's hand.
    """

    centre: Array
    wrist: WristPlane
    hand: HandSize

    @property
    def to_surface(self) -> Array:
        """Vector (3,) from the centre of the palm to its visible surface, metres."""
        return -self.hand.palm_half_thickness * self.centre / np.linalg.norm(self.centre)


def segment_roi(
    frame: Frame, prior: RoiPrior, skin: AdaptiveSkin | None, options: SegmentationOptions
) -> HandMasks | None:
    """Return the masks of the hand at its predicted place, or None with too few readings there.

    skin: skin colours, used if the frame has colour.
    """
    if prior.centre[2] <= options.roi.nearest_centre:
        return None
    camera, reach = frame.camera, prior.hand.reach + options.roi.reach_margin
    region = camera.rect_around(prior.centre, reach)
    depth = np.ascontiguousarray(frame.depth[region.slices])
    lens = (camera.fx, camera.fy, camera.cx - region.left, camera.cy - region.top)
    kinds = np.empty(depth.shape, dtype=np.uint8)
    wrist, normal = prior.wrist.point + options.wrist_margin * prior.wrist.normal, prior.wrist.normal
    mark_reachable(depth, lens, prior.centre, reach, wrist, normal, kinds)
    limits = (options.grid.max_jump, options.roi.border_share)
    readings = without_continuing_surfaces(depth, kinds, kinds == READING, camera.fx, *limits)
    if not readings.any():
        return None
    radius, margin = dilation_radius(camera, options.outline), options.roi.margin * camera.fx / float(prior.centre[2])
    # The closing below needs twice its radius around the readings.
    near = bounding_box(readings, max(2 * radius + 1, round(margin)))
    readings, missing = readings[near.slices], kinds[near.slices] == MISSING
    silhouette = readings
    if skin is not None and frame.colour is not None:
        within = kinds[near.slices] != OUTSIDE
        coloured = skin.find_among(frame.colour, near.shifted(region.left, region.top), within)
        readings = readings & dilated(coloured, radius)
        # Skin without a reading counts in gaps between readings only: outside them, shadows can have its colour.
        silhouette = readings | (coloured & closed(readings, radius) & missing)
    silhouette = without_small_components(silhouette, options.roi.small_component)
    readings = readings & silhouette
    if np.count_nonzero(readings) < options.roi.least_readings:
        return None
    roi, whole = bounding_box(silhouette, round(margin)), near.shifted(region.left, region.top)
    return HandMasks(roi.shifted(whole.left, whole.top), silhouette[roi.slices], readings[roi.slices])


@compiled(nogil=True)
def mark_reachable(
    depth: Depth,
    lens: tuple[float, float, float, float],
    centre: Array,
    reach: float,
    wrist: Array,
    towards_arm: Array,
    out: Labels,
) -> None:
    """Mark the pixels within a hand's reach and before its wrist.

    depth: (h, w), metres.
    lens: fx, fy, cx, cy, pixels.
    centre: (3,) of the palm, metres, camera frame.
    reach: metres.
    wrist, towards_arm: (3,) point, metres, and unit normal of the wrist's plane, camera frame.
    out: (h, w) output: one of the kinds of `continuing_surfaces`.
    """
    fx, fy, cx, cy = lens
    (px, py, pz), (wx, wy, wz), (ax, ay, az) = centre, wrist, towards_arm
    rays = np.empty(depth.shape[1])
    for u in range(depth.shape[1]):
        rays[u] = (u - cx) / fx
    for v in range(depth.shape[0]):
        row, kinds, ray = depth[v], out[v], (v - cy) / fy
        for u in range(depth.shape[1]):
            # Without branches, so that the compiler makes vectors of it.
            reading = np.float64(row[u])
            kind = READING if reading > 0.0 else MISSING
            z = reading if reading > 0.0 else pz
            x, y = rays[u] * z, ray * z
            dx, dy, dz = x - px, y - py, z - pz
            beyond = (x - wx) * ax + (y - wy) * ay + (z - wz) * az
            near = dx * dx + dy * dy + dz * dz < reach * reach
            kinds[u] = OUTSIDE if not near else kind if beyond < 0.0 else BEYOND_WRIST
