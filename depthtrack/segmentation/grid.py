"""The visible surface on a coarse grid, with cheap connectivity and geodesic distances.

A node represents a block of `stride` x `stride` pixels. Neighbouring nodes are connected if their depths differ by less
than `max_jump`: a face or a chest behind a hand is another surface.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rectangle import Rect
from depthtrack.segmentation.grid_kernels import label_surfaces, sample_blocks, shortest_paths
from depthtrack.segmentation.options import GridOptions
from depthtrack.types import Array, Array32, Depth, Mask


@dataclass(frozen=True)
class Paths:
    """Shortest paths along a surface.

    distance: (rows, columns) geodesic distance from the nearest source, metres; infinite without a path.
    parent: (rows, columns) flat index of the previous node on the path; a source is its own parent, -1 without a path.
    """

    distance: Depth
    parent: NDArray[np.int32]

    def trace(self, node: int) -> list[int]:
        """Return the flat indices of the path from `node` back to its source, both included."""
        path = [node]
        while (before := int(self.parent.flat[path[-1]])) != path[-1]:
            path.append(before)
        return path

    def reached(self, limit: float = np.inf) -> Mask:
        """Return the nodes (rows, columns) at most `limit` metres away."""
        return np.isfinite(self.distance) & (self.distance <= limit)


@dataclass(frozen=True)
class Grid:
    """Nodes (rows, columns) over a region of a depth image.

    depth: (rows, columns), metres; 0 if the block has no surface within the depth range.
    points: (rows * columns, 3), metres, camera frame.
    focal: (fx, fy), nodes.
    stride: side of a block, pixels; the block of node (i, j) starts at pixel (j stride, i stride) of the region.
    max_jump: depth step between connected neighbours, metres.
    """

    depth: Depth
    points: Array
    focal: tuple[float, float]
    stride: int
    max_jump: float

    @classmethod
    def over(
        cls,
        depth: Depth,
        camera: Camera,
        region: Rect,
        depth_range: tuple[float, float],
        stride: int,
        options: GridOptions | None = None,
    ) -> Self:
        """Return the grid over a region of a depth image.

        depth: (h, w), metres, of `camera`.
        depth_range: nearest and farthest valid depth, metres.
        """
        options = options or GridOptions()
        nodes = np.empty((-(-region.height // stride), -(-region.width // stride)), dtype=np.float32)
        points = np.empty((nodes.size, 3))
        lens = (camera.fx, camera.fy, camera.cx, camera.cy)
        near, far = depth_range
        share = options.least_depth_share
        sample_blocks(depth, tuple(region), lens, near, far, stride, options.max_jump, share, nodes, points)
        return cls(nodes, points, (camera.fx / stride, camera.fy / stride), stride, options.max_jump)

    @cached_property
    def areas(self) -> Array32:
        """Areas (rows, columns) of the blocks across the line of sight, m^2; 0 without a surface."""
        return self.depth * self.depth * np.float32(1 / (self.focal[0] * self.focal[1]))

    @property
    def edge(self) -> Mask:
        """Outermost nodes (rows, columns), through which a surface leaves the region."""
        edge = np.zeros(self.depth.shape, dtype=np.bool_)
        edge[[0, -1], :] = edge[:, [0, -1]] = True
        return edge

    def within(self, mask: Mask) -> Self:
        """Return the grid with only the nodes of `mask` (rows, columns)."""
        return replace(self, depth=np.where(mask, self.depth, np.float32(0)))

    def surfaces(self) -> tuple[NDArray[np.int32], Array]:
        """Return the connected surface of each node, and the areas of the surfaces.

        labels: (rows, columns), -1 without a surface.
        areas: (S,), m^2.
        """
        labels = np.empty(self.depth.shape, dtype=np.int32)
        squares = np.empty(self.depth.size)
        count = label_surfaces(self.depth, self.max_jump, labels, squares)
        return labels, squares[:count] / (self.focal[0] * self.focal[1])

    def paths(self, sources: ArrayLike, limit: float) -> Paths:
        """Return the shortest paths along the surface from nodes.

        sources: flat indices.
        limit: length of the longest path, metres.
        """
        paths = Paths(np.full(self.depth.shape, np.inf, np.float32), np.full(self.depth.shape, -1, np.int32))
        self.extend(paths, sources, limit)
        return paths

    def extend(self, paths: Paths, sources: ArrayLike, limit: float) -> None:
        """Add sources (flat indices) to `paths`, in place."""
        nodes = np.asarray(sources, dtype=np.int64)
        shortest_paths(self.depth, self.points, self.max_jump, nodes, limit, paths.distance, paths.parent)

    def inscribed(self, mask: Mask) -> Depth:
        """Return the radius of the largest circle around each node within a mask, metres.

        It is measured across the line of sight; the region's edge bounds circles too.
        """
        padded = np.zeros((mask.shape[0] + 2, mask.shape[1] + 2), dtype=np.uint8)
        padded[1:-1, 1:-1] = mask
        cells = cv2.distanceTransform(padded, cv2.DIST_L2, cv2.DIST_MASK_5)[1:-1, 1:-1]
        return np.asarray(cells * self.depth * np.float32(1 / self.focal[0]), dtype=np.float32)
