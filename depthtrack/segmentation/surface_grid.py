"""The surface grid of a region of a frame, and the nodes of it that may be hand."""

from dataclasses import dataclass

import cv2
import numpy as np

from depthtrack.compilation import compiled
from depthtrack.geometry.rectangle import Rect
from depthtrack.recording.sequence import Frame
from depthtrack.segmentation.grid import Grid
from depthtrack.segmentation.morphology import closed, disc
from depthtrack.segmentation.options import GridOptions
from depthtrack.segmentation.skin_adaptation import AdaptiveSkin
from depthtrack.types import Array32, Labels, Mask


@dataclass(frozen=True)
class SurfaceGrid:
    """The grid of a region of a frame.

    grid: all nodes within the depth range.
    candidates: the nodes that may be hand: those of skin, or all of them without colour.
    skin: (h, w) over the region, not 0 on skin; None without colour.
    """

    frame: Frame
    region: Rect
    grid: Grid
    candidates: Grid
    skin: Labels | None


def build_grid(
    frame: Frame,
    region: Rect,
    depth_range: tuple[float, float],
    stride: int,
    skin: AdaptiveSkin | None,
    options: GridOptions,
) -> SurfaceGrid:
    """Return the grid of a region of a frame.

    depth_range: nearest and farthest valid depth, metres.
    stride: side of a node's block, pixels.
    skin: skin colours, used if the frame has colour.
    """
    grid = Grid.over(frame.depth, frame.camera, region, depth_range, stride, options)
    if skin is None or frame.colour is None:
        return SurfaceGrid(frame, region, grid, grid, None)
    # Only nodes within the depth range and their neighbours are classified: edges of depth are ragged.
    beside = cv2.dilate((grid.depth > 0).astype(np.uint8), disc(1))
    blocks = np.asarray(beside, dtype=np.uint8)
    found = skin.find(frame.colour, region, blocks, stride)
    nodes = closed(_covered(found, stride, options.least_skin_share, blocks), options.closing_radius)
    return SurfaceGrid(frame, region, grid, grid.within(nodes), found)


def blind_skin(surface: SurfaceGrid, skin: AdaptiveSkin, options: GridOptions) -> Mask:
    """Return the nodes (rows, columns) of skin without readings.

    An arm nearer than the sensor's range has none.
    """
    frame, grid, share = surface.frame, surface.grid, options.least_blind_share
    if frame.colour is None:
        return np.zeros(grid.depth.shape, dtype=np.bool_)
    everywhere = np.ones(grid.depth.shape, dtype=np.uint8)
    missing = _covered((frame.depth[surface.region.slices] == 0).astype(np.uint8), grid.stride, share, everywhere)
    found = skin.find(frame.colour, surface.region, missing.astype(np.uint8), grid.stride)
    return missing & _covered(found, grid.stride, share, missing.astype(np.uint8))


def _covered(mask: Labels, stride: int, share: float, blocks: Labels) -> Mask:
    """Return the blocks (rows, columns; not 0) that `mask` (h, w) covers by at least `share`."""
    shares = np.zeros(blocks.shape, dtype=np.float32)
    share_of_blocks(mask, stride, blocks, shares)
    return shares >= share


@compiled()
def share_of_blocks(mask: Labels, stride: int, blocks: Labels, share: Array32) -> None:
    """Compute the share of each block that a mask covers.

    mask: (h, w), not 0 where it is set.
    stride: side of a block, pixels; blocks of 4 pixels or more are sampled at every second row and column.
    blocks: (rows, columns), 0 for blocks to leave out.
    share: (rows, columns) output.
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
