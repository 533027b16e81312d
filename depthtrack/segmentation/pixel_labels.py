"""From nodes back to pixels: which pixels of a frame belong to the hand that was found on the grid."""

import cv2
import numba
import numpy as np

from depthtrack.geometry.rectangle import Rect
from depthtrack.segmentation.grid import MAX_JUMP
from depthtrack.segmentation.palm import HAND_REACH, TIP_TO_WRIST, Palm
from depthtrack.segmentation.roi_tracking import DILATION, ROI_MARGIN, bounding_box
from depthtrack.segmentation.surface_grid import SurfaceGrid, dilated, disc, eroded
from depthtrack.segmentation.wrist import WristPlane
from depthtrack.types import Depth, Labels, Mask

ELSEWHERE, HAND, ARM, BESIDE = 0, 1, 2, 4
"""Labels of nodes, one bit each; BESIDE is what hangs together with the hand and is neither hand nor arm."""

NOTHING, MISSING, OTHER, READING = 0, 1, 2, 3
"""Kinds of pixels: far from the hand; without a reading, beside the hand; a reading of what hangs together with the
hand; a reading of the hand."""

MARGIN = 2
"""Nodes around the hand's into which its pixels may reach."""


def label_hand(view: SurfaceGrid, palm: Palm, arm: Mask | None, wrist: WristPlane | None) -> Labels:
    """ELSEWHERE, HAND, ARM or BESIDE (rows, columns) for every node; `arm` (rows, columns) are the arm's."""
    surface = view.surface
    hand = (surface.depth > 0) & palm.paths.reached(TIP_TO_WRIST)
    # Fingertips cut off by what the hand holds, or by fingers in front, are pieces of surface within its reach.
    pieces, _ = surface.within(~hand).surfaces()
    nodes = np.flatnonzero(pieces >= 0)
    points, piece = surface.points[nodes], pieces.ravel()[nodes]
    inside = np.linalg.norm(points - palm.centre, axis=1) < HAND_REACH
    if wrist is not None:
        inside &= (points - wrist.point) @ wrist.normal < 0
    sizes = np.bincount(piece)
    whole = np.bincount(piece, inside, sizes.size) > 0.9 * sizes
    hand.flat[nodes[whole[piece]]] = True
    labels = np.where(palm.paths.reached(), np.uint8(BESIDE), np.uint8(ELSEWHERE))
    labels[hand] = HAND
    if arm is not None:
        labels[arm] = ARM
    return labels


def hand_masks(view: SurfaceGrid, labels: Labels, wrist: WristPlane | None) -> tuple[Rect, Mask, Mask]:
    """The region of interest in the frame, with the hand's silhouette and its readings (h, w) in it.

    Within r of the outline of its readings, where depth is least sure, only what has the colour of skin is hand;
    farther inside, depth alone decides, so that shadows and highlights leave no holes. Missing readings between others
    are filled where they are skin, and the outline is smoothed. Readings count up to r outside the silhouette.
    """
    blocks = bounding_box(labels == HAND, MARGIN)
    stride, region, frame = view.grid.stride, view.region, view.frame
    tight = blocks.scaled(stride).shifted(region.left, region.top).clipped(region)
    plane = (0.0, 0.0, 0.0, 0.0) if wrist is None else (*wrist.normal.tolist(), float(wrist.normal @ wrist.point))
    lens = (frame.camera.fx, frame.camera.fy, frame.camera.cx, frame.camera.cy)
    kinds = np.empty(tight.shape, dtype=np.uint8)
    sort_pixels(frame.depth, tuple(tight), view.grid.depth, labels, tuple(blocks), stride, lens, plane, kinds)
    silhouette = readings = kinds == READING
    if view.skin is not None:
        coloured = view.skin[tight.relative_to(region).slices] > 0
        r = max(1, round(DILATION * frame.camera.width))
        silhouette = _silhouette(kinds, coloured, frame.depth[tight.slices] == 0, r)
        readings = readings & dilated(silhouette, r)
    room = round(ROI_MARGIN * frame.camera.fx / float(view.grid.depth[labels == HAND].mean()))
    roi = tight.grown(max(room - MARGIN * stride, 0)).clipped(frame.camera.rect)
    return roi, tight.paste(silhouette, roi), tight.paste(readings, roi)


def _silhouette(kinds: Labels, coloured: Mask, missing: Mask, r: int) -> Mask:
    """The hand's silhouette (h, w) from the kinds of its pixels, where they are `coloured` like skin, and where
    readings are `missing`."""
    readings = kinds == READING
    inside = readings & eroded(kinds >= OTHER, r)
    closed = cv2.morphologyEx(readings.view(np.uint8), cv2.MORPH_CLOSE, disc(max(1, r // 4))).view(np.bool_)
    # Through a ring of fingers one sees what is behind: what is read there is not filled.
    filled = closed | (missing & _enclosed(closed))
    return inside | (coloured & _smoothed(inside | (coloured & filled & (kinds != OTHER)), r))


def _enclosed(mask: Mask) -> Mask:
    """What cannot be reached from outside without crossing `mask` (h, w), and the mask itself."""
    framed = np.zeros((mask.shape[0] + 2, mask.shape[1] + 2), dtype=np.uint8)
    framed[1:-1, 1:-1] = mask
    cv2.floodFill(framed, None, (0, 0), 2)
    return framed[1:-1, 1:-1] != 2


def _smoothed(mask: Mask, r: int) -> Mask:
    """The majority of the pixels about each: sensors' outlines waver by a pixel.

    A little less than half suffices, for readings are lost at outlines and never won.
    """
    side = 2 * (r // 2) + 1
    share = cv2.boxFilter(mask.view(np.uint8) * np.uint8(200), -1, (side, side), borderType=cv2.BORDER_REPLICATE)
    return np.asarray(share > 85)


@numba.njit(cache=True)
def sort_pixels(
    depth: Depth,
    roi: tuple[int, int, int, int],
    nodes: Depth,
    labels: Labels,
    blocks: tuple[int, int, int, int],
    stride: int,
    lens: tuple[float, float, float, float],
    plane: tuple[float, float, float, float],
    out: Labels,
) -> None:
    """Kind of every pixel in the region `roi` of a depth image (h, w; metres), into `out`.

    `nodes` and `labels` (rows, columns) are the grid's, whose `blocks` are in the region. A reading belongs to the
    node, of its own block and those around it, whose depth is nearest to its own, if that is within MAX_JUMP: to hand
    or arm if there are any. A pixel without a reading belongs to the nearest block. Where arm and hand meet, the plane
    (a, b, c, d) decides instead: the hand is where a x + b y + c z <= d.
    """
    rows, columns = nodes.shape
    left, top, right, bottom = roi
    j0, i0, j1, i1 = blocks
    fx, fy, cx, cy = lens
    a, b, c, d = plane
    jump = np.float32(MAX_JUMP)
    near, kind = np.empty(9, dtype=np.float32), np.empty(9, dtype=np.uint8)
    out[:] = NOTHING
    for i in range(i0, i1):
        for j in range(j0, j1):
            # The nodes around that are somewhere, and what a pixel without a reading belongs to.
            count, around, blank, blank_depth, least = 0, ELSEWHERE, ELSEWHERE, np.float32(0), 9
            for k in range(max(i - 1, 0), min(i + 2, rows)):
                for m in range(max(j - 1, 0), min(j + 2, columns)):
                    label = labels[k, m]
                    if label == ELSEWHERE:
                        continue
                    near[count], kind[count] = nodes[k, m], label
                    count, around = count + 1, around | label
                    away = (k - i) ** 2 + (m - j) ** 2
                    if label != BESIDE and away < least:
                        least, blank, blank_depth = away, label, nodes[k, m]
            if count == 0:
                continue
            deep = around == HAND == labels[i, j]
            u0, v0 = left + (j - j0) * stride, top + (i - i0) * stride
            for v in range(v0, min(v0 + stride, bottom)):
                for u in range(u0, min(u0 + stride, right)):
                    z = depth[v, u]
                    if deep and abs(nodes[i, j] - z) < jump:
                        out[v - top, u - left] = READING  # deep inside the hand
                        continue
                    mine, close, met = blank, blank_depth, around
                    if z > 0:
                        mine, close, met, nearest = ELSEWHERE, z, ELSEWHERE, jump
                        for n in range(count):
                            difference = abs(near[n] - z)
                            if difference < jump:
                                met |= kind[n]
                                if difference < nearest and kind[n] != BESIDE:
                                    nearest, mine = difference, kind[n]
                    hand = bool(mine == HAND)
                    if met & (HAND | ARM) == HAND | ARM:
                        hand = bool((a * (u - cx) / fx + b * (v - cy) / fy + c) * close <= d)
                    if z > 0:
                        if met != ELSEWHERE:
                            out[v - top, u - left] = READING if hand else OTHER
                    elif hand:
                        out[v - top, u - left] = MISSING
