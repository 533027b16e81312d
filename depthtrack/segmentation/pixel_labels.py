"""Labels of pixels: the pixels of a frame that belong to the hand on its grid."""

import cv2
import numpy as np

from depthtrack.compilation import compiled
from depthtrack.segmentation.masks import HandMasks, dilation_radius
from depthtrack.segmentation.morphology import bounding_box, dilated, disc, eroded
from depthtrack.segmentation.options import OutlineOptions, SegmentationOptions
from depthtrack.segmentation.palm import Palm
from depthtrack.segmentation.surface_grid import SurfaceGrid
from depthtrack.segmentation.wrist import WristPlane
from depthtrack.types import Array, Depth, Labels, Mask

BACKGROUND, HAND, ARM, ATTACHED = 0, 1, 2, 4
"""Labels of nodes, one bit each; ATTACHED is connected to the hand but neither hand nor arm."""

NOTHING, MISSING, OTHER, READING = 0, 1, 2, 3
"""Kinds of pixels: far from the hand; no reading, beside the hand; a reading of a surface connected to the hand; a
reading of the hand."""


def label_hand(
    surface: SurfaceGrid,
    palm: Palm,
    centre: Array,
    arm: Mask | None,
    wrist: WristPlane | None,
    options: SegmentationOptions,
) -> Labels:
    """Return BACKGROUND, HAND, ARM or ATTACHED (rows, columns) for each node.

    centre: (3,) of the palm, metres, camera frame. That of `palm`, where paths begin, may be nearer to the arm.
    arm: (rows, columns) nodes of the arm.
    """
    candidates = surface.candidates
    moved = float(np.linalg.norm(centre - palm.centre))
    hand = (candidates.depth > 0) & palm.paths.reached(options.palm.tip_to_wrist + moved)
    # Fingertips behind a held object or behind other fingers are detached components within the hand's reach.
    components, _ = candidates.within(~hand).surfaces()
    nodes = np.flatnonzero(components >= 0)
    points, component = candidates.points[nodes], components.ravel()[nodes]
    inside = np.linalg.norm(points - centre, axis=1) < options.palm.hand_reach
    if wrist is not None:
        inside &= (points - wrist.point) @ wrist.normal < 0
    sizes = np.bincount(component)
    whole = np.bincount(component, inside, sizes.size) > options.outline.whole_share * sizes
    hand.flat[nodes[whole[component]]] = True
    labels = np.where(palm.paths.reached(), np.uint8(ATTACHED), np.uint8(BACKGROUND))
    labels[hand] = HAND
    if arm is not None:
        labels[arm] = ARM
    return labels


def hand_masks(
    surface: SurfaceGrid, labels: Labels, wrist: WristPlane | None, options: SegmentationOptions
) -> HandMasks:
    """Return the masks of the hand from the labels (rows, columns) of nodes.

    At least one node must be HAND.

    Near the outline, depth is least reliable: within the dilation radius of it, only skin-coloured pixels are hand.
    Farther inside, depth alone decides, so that shadows and highlights leave no holes. Missing readings between others
    are filled if they are skin, and the outline is smoothed. Readings extend up to the radius outside the silhouette.
    """
    margin, outline = options.outline.node_margin, options.outline
    blocks = bounding_box(labels == HAND, margin)
    stride, region, frame = surface.grid.stride, surface.region, surface.frame
    tight = blocks.scaled(stride).shifted(region.left, region.top).clipped(region)
    plane = (0.0, 0.0, 0.0, 0.0) if wrist is None else (*wrist.normal.tolist(), float(wrist.normal @ wrist.point))
    lens = (frame.camera.fx, frame.camera.fy, frame.camera.cx, frame.camera.cy)
    kinds, jump = np.empty(tight.shape, dtype=np.uint8), options.grid.max_jump
    nodes, roi, on_grid = surface.grid.depth, tuple(tight), tuple(blocks)
    classify_pixels(frame.depth, roi, nodes, labels, on_grid, stride, jump, lens, plane, kinds)
    silhouette = readings = kinds == READING
    if surface.skin is not None:
        coloured = surface.skin[tight.relative_to(region).slices] > 0
        radius = dilation_radius(frame.camera, outline)
        silhouette = _silhouette(kinds, coloured, frame.depth[tight.slices] == 0, radius, outline)
        readings = readings & dilated(silhouette, radius)
    room = round(options.roi.margin * frame.camera.fx / float(surface.grid.depth[labels == HAND].mean()))
    region = tight.grown(max(room - margin * stride, 0)).clipped(frame.camera.rect)
    return HandMasks(region, tight.paste(silhouette, region), tight.paste(readings, region))


def _silhouette(kinds: Labels, coloured: Mask, missing: Mask, radius: int, options: OutlineOptions) -> Mask:
    """Return the hand's silhouette (h, w).

    kinds: (h, w) of pixels.
    coloured, missing: (h, w) pixels of skin, and without readings.
    radius: of the dilation, pixels.
    """
    readings = kinds == READING
    inside = readings & eroded(kinds >= OTHER, radius)
    element = disc(max(1, radius // options.closing_divisor))
    closed = cv2.morphologyEx(readings.view(np.uint8), cv2.MORPH_CLOSE, element).view(np.bool_)
    # A ring of fingers shows the background: its readings are not filled.
    filled = closed | (missing & _enclosed(closed))
    candidates = inside | (coloured & filled & (kinds != OTHER))
    return inside | (coloured & _majority(candidates, radius // options.smoothing_divisor, options.majority))


def _enclosed(mask: Mask) -> Mask:
    """Return `mask` (h, w) and the pixels that it separates from the border."""
    framed = np.zeros((mask.shape[0] + 2, mask.shape[1] + 2), dtype=np.uint8)
    framed[1:-1, 1:-1] = mask
    cv2.floodFill(framed, None, (0, 0), 2)
    return framed[1:-1, 1:-1] != 2


def _majority(mask: Mask, radius: int, least: int) -> Mask:
    """Return the pixels (h, w) with more than `least` of 200 pixels set around them.

    It smooths outlines, which waver by a pixel.
    """
    side = 2 * radius + 1
    share = cv2.boxFilter(mask.view(np.uint8) * np.uint8(200), -1, (side, side), borderType=cv2.BORDER_REPLICATE)
    return np.asarray(share > least)


@compiled()
def classify_pixels(
    depth: Depth,
    roi: tuple[int, int, int, int],
    nodes: Depth,
    labels: Labels,
    blocks: tuple[int, int, int, int],
    stride: int,
    max_jump: float,
    lens: tuple[float, float, float, float],
    plane: tuple[float, float, float, float],
    out: Labels,
) -> None:
    """Classify the pixels of a region of a depth image.

    depth: (h, w), metres.
    roi: left, top, right, bottom of the region, pixels.
    nodes, labels: (rows, columns) depths, metres, and labels of the grid.
    blocks: left, top, right, bottom of the region on the grid, nodes.
    stride: side of a block, pixels.
    max_jump: largest difference of a pixel's depth from its node's, metres.
    lens: fx, fy, cx, cy of the image, pixels.
    plane: a, b, c, d of the wrist; the hand is at a x + b y + c z <= d.
    out: output over the region: NOTHING, MISSING, OTHER or READING.

    A reading belongs to the node nearest in depth among its own block and the eight around it. Hand and arm take
    precedence. A pixel without a reading belongs to the nearest block. If hand and arm meet, the plane decides.
    """
    rows, columns = nodes.shape
    left, top, right, bottom = roi
    j0, i0, j1, i1 = blocks
    fx, fy, cx, cy = lens
    a, b, c, d = plane
    jump = np.float32(max_jump)
    near, kind = np.empty(9, dtype=np.float32), np.empty(9, dtype=np.uint8)
    out[:] = NOTHING
    for i in range(i0, i1):
        for j in range(j0, j1):
            # The labelled nodes around, and the node of a pixel without a reading.
            count, around, blank, blank_depth, least = 0, BACKGROUND, BACKGROUND, np.float32(0), 9
            for k in range(max(i - 1, 0), min(i + 2, rows)):
                for m in range(max(j - 1, 0), min(j + 2, columns)):
                    label = labels[k, m]
                    if label == BACKGROUND:
                        continue
                    near[count], kind[count] = nodes[k, m], label
                    count, around = count + 1, around | label
                    away = (k - i) ** 2 + (m - j) ** 2
                    if label != ATTACHED and away < least:
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
                        mine, close, met, nearest = BACKGROUND, z, BACKGROUND, jump
                        for n in range(count):
                            difference = abs(near[n] - z)
                            if difference < jump:
                                met |= kind[n]
                                if difference < nearest and kind[n] != ATTACHED:
                                    nearest, mine = difference, kind[n]
                    hand = bool(mine == HAND)
                    if met & (HAND | ARM) == HAND | ARM:
                        hand = bool((a * (u - cx) / fx + b * (v - cy) / fy + c) * close <= d)
                    if z > 0:
                        if met != BACKGROUND:
                            out[v - top, u - left] = READING if hand else OTHER
                    elif hand:
                        out[v - top, u - left] = MISSING
