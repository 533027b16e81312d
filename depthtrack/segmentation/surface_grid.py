"""What is seen in a region of a frame: surfaces on a grid, and which of them may be hand."""

from dataclasses import dataclass
from functools import cache

import cv2
import numba
import numpy as np

from depthtrack.geometry.rectangle import Rect
from depthtrack.recording.sequence import Frame
from depthtrack.segmentation.grid import Grid
from depthtrack.segmentation.skin_adaptation import AdaptiveSkin
from depthtrack.types import Array32, Labels, Mask


@dataclass(frozen=True)
class SurfaceGrid:
    """`grid` of everything within reach in a `region` of a frame, and `surface`, its nodes that may be hand: those of
    skin, or all of them where only depth is used. `skin` (h, w) covers the region, not 0 on skin, or None."""

    frame: Frame
    region: Rect
    grid: Grid
    surface: Grid
    skin: Labels | None


def build_grid(
    frame: Frame, region: Rect, reach: tuple[float, float], stride: int, skin: AdaptiveSkin | None
) -> SurfaceGrid:
    """A view of what is between `reach` (nearest, farthest; metres), on blocks of `stride` x `stride` pixels."""
    grid = Grid.over(frame.depth, frame.camera, region, reach, stride)
    if skin is None or frame.colour is None:
        return SurfaceGrid(frame, region, grid, grid, None)
    # Colour is asked only about what is within reach, and right beside it: edges of depth are ragged.
    beside = cv2.dilate((grid.depth > 0).astype(np.uint8), disc(1))
    blocks = np.asarray(beside, dtype=np.uint8)
    found = skin.find(frame.colour, region, blocks, stride)
    return SurfaceGrid(frame, region, grid, grid.within(_closed(_covered(found, stride, 0.25, blocks))), found)


def blind_skin(view: SurfaceGrid, skin: AdaptiveSkin) -> Mask:
    """Nodes (rows, columns) of skin without readings, into which what is too near to the sensor vanishes."""
    if view.frame.colour is None:
        return np.zeros(view.grid.depth.shape, dtype=np.bool_)
    everywhere = np.ones(view.grid.depth.shape, dtype=np.uint8)
    missing = _covered((view.frame.depth[view.region.slices] == 0).astype(np.uint8), view.grid.stride, 0.5, everywhere)
    found = skin.find(view.frame.colour, view.region, missing.astype(np.uint8), view.grid.stride)
    return missing & _covered(found, view.grid.stride, 0.5, missing.astype(np.uint8))


@cache
def disc(radius: int) -> Labels:
    """A round structuring element."""
    y, x = np.ogrid[-radius : radius + 1, -radius : radius + 1]
    # Half a pixel more, so that small discs are not pointed.
    return (x * x + y * y <= (radius + 0.5) ** 2 - 0.25).astype(np.uint8)


def dilated(mask: Mask, radius: int) -> Mask:
    """What is within `radius` pixels, at least 1, of a mask (h, w)."""
    square, diamond = _parts_of_disc(radius)
    return cv2.dilate(cv2.dilate(mask.view(np.uint8), square), diamond).view(np.bool_)


def eroded(mask: Mask, radius: int) -> Mask:
    """What is farther than `radius` pixels, at least 1, from everything outside a mask (h, w); the image's edge is no
    outside."""
    square, diamond = _parts_of_disc(radius)
    return cv2.erode(cv2.erode(mask.view(np.uint8), square), diamond).view(np.bool_)


@cache
def _parts_of_disc(radius: int) -> tuple[Labels, Labels]:
    """A square and a diamond that make `disc(radius)` when used one after the other, at half the cost.

    They do so exactly up to 5 pixels; beyond, they make an octagon.
    """
    half = max(1, round(radius * (np.sqrt(2) - 1)))
    y, x = np.ogrid[half - radius : radius - half + 1, half - radius : radius - half + 1]
    return np.ones((2 * half + 1, 2 * half + 1), np.uint8), (abs(x) + abs(y) <= radius - half).astype(np.uint8)


def _closed(nodes: Mask) -> Mask:
    """With gaps up to 4 nodes wide closed: a shadow, a highlight, a ring."""
    return np.asarray(cv2.morphologyEx(nodes.astype(np.uint8), cv2.MORPH_CLOSE, disc(2)) > 0)


def _covered(mask: Labels, stride: int, share: float, blocks: Labels) -> Mask:
    """Those of `blocks` (rows, columns; not 0) that `mask` (h, w) covers to at least `share`."""
    shares = np.zeros(blocks.shape, dtype=np.float32)
    share_of_blocks(mask, stride, blocks, shares)
    return shares >= share


@numba.njit(cache=True)
def share_of_blocks(mask: Labels, stride: int, blocks: Labels, share: Array32) -> None:
    """Share of each of `blocks` (rows, columns; not 0) that `mask` (h, w) covers, into `share` (rows, columns).

    Looks at every second pixel both ways where blocks are large enough.
    """
    height, width = mask.shape
    step = 1 if stride < 4 else 2
    for i in range(share.shape[0]):
        for j in range(share.shape[1]):
            if blocks[i, j] == 0:
                continue
            count, size = 0, 0
            for v in range(i * stride, min((i + 1) * stride, height), step):
                for u in range(j * stride, min((j + 1) * stride, width), step):
                    count += mask[v, u] != 0
                    size += 1
            share[i, j] = np.float32(count) / np.float32(size)
