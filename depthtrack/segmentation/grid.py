"""The visible surface on a coarse grid, where connectivity and distances along the surface are cheap.

A node stands for a block of `stride` x `stride` pixels. Two neighbouring nodes are connected when their depths differ
by less than MAX_JUMP: what lies behind a hand, a face or a chest, is another surface.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import cv2
import numba
import numpy as np
from numpy.typing import ArrayLike, NDArray

from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rectangle import Rect
from depthtrack.types import Array, Array32, Depth, Index, Mask

MAX_JUMP = 0.03
"""Metres of depth between neighbouring nodes of one surface. A node is about 5 mm wide, so that surfaces turned 80
degrees away from the camera still hold together."""

BUCKET = 0.002
"""Metres; how finely the queue of the shortest-path search is sorted. It affects speed, never the result."""


@dataclass(frozen=True)
class Paths:
    """Shortest paths along a surface: `distance` (rows, columns) metres from the nearest source, infinite where none
    leads; `parent` (rows, columns) the flat index of the node before on the path, itself at a source, -1 where none."""

    distance: Depth
    parent: NDArray[np.int32]

    def trace(self, node: int) -> list[int]:
        """Flat indices of the path from `node` back to its source, both included."""
        path = [node]
        while (before := int(self.parent.flat[path[-1]])) != path[-1]:
            path.append(before)
        return path

    def reached(self, limit: float = np.inf) -> Mask:
        """Nodes (rows, columns) at most `limit` metres away."""
        return np.isfinite(self.distance) & (self.distance <= limit)


@dataclass(frozen=True)
class Grid:
    """Nodes (rows, columns) over a region of a depth image.

    `depth` metres, 0 where a block shows no surface within reach; `points` (rows * columns, 3) metres in the camera
    frame; `focal` (fx, fy) in nodes. The block of node (i, j) starts at pixel (j stride, i stride) of the region.
    """

    depth: Depth
    points: Array
    focal: tuple[float, float]
    stride: int

    @classmethod
    def over(cls, depth: Depth, camera: Camera, region: Rect, reach: tuple[float, float], stride: int) -> Self:
        """The grid over a region of a depth image (h, w) in metres, seen by `camera`.

        Only readings within `reach` (nearest, farthest) count.
        """
        nodes = np.empty((-(-region.height // stride), -(-region.width // stride)), dtype=np.float32)
        points = np.empty((nodes.size, 3))
        lens = (camera.fx, camera.fy, camera.cx, camera.cy)
        sample_blocks(depth, tuple(region), lens, reach[0], reach[1], stride, nodes, points)
        return cls(nodes, points, (camera.fx / stride, camera.fy / stride), stride)

    @cached_property
    def areas(self) -> Array32:
        """(rows, columns) square metres that a node's block spans across the line of sight; 0 without a surface."""
        return self.depth * self.depth * np.float32(1 / (self.focal[0] * self.focal[1]))

    @property
    def edge(self) -> Mask:
        """(rows, columns): the outermost nodes, through which a surface leaves the region."""
        edge = np.zeros(self.depth.shape, dtype=np.bool_)
        edge[[0, -1], :] = edge[:, [0, -1]] = True
        return edge

    def within(self, mask: Mask) -> Self:
        """The same grid with only the nodes of `mask` (rows, columns)."""
        return replace(self, depth=np.where(mask, self.depth, np.float32(0)))

    def surfaces(self) -> tuple[NDArray[np.int32], Array]:
        """Label (rows, columns) of each node's connected surface, -1 for none; areas (S,) of these in square metres."""
        labels = np.empty(self.depth.shape, dtype=np.int32)
        squares = np.empty(self.depth.size)
        count = label_surfaces(self.depth, labels, squares)
        return labels, squares[:count] / (self.focal[0] * self.focal[1])

    def paths(self, sources: ArrayLike, limit: float) -> Paths:
        """Shortest paths along the surface from `sources` (flat indices), up to `limit` metres."""
        paths = Paths(np.full(self.depth.shape, np.inf, np.float32), np.full(self.depth.shape, -1, np.int32))
        self.extend(paths, sources, limit)
        return paths

    def extend(self, paths: Paths, sources: ArrayLike, limit: float) -> None:
        """Add `sources` to those that `paths` was made from, in place."""
        spread(self.depth, self.points, np.asarray(sources, dtype=np.int64), limit, paths.distance, paths.parent)

    def inscribed(self, mask: Mask) -> Depth:
        """Radius (rows, columns), metres, of the largest circle around each node that stays within `mask`.

        Measured across the line of sight; the region's edge bounds circles too.
        """
        padded = np.zeros((mask.shape[0] + 2, mask.shape[1] + 2), dtype=np.uint8)
        padded[1:-1, 1:-1] = mask
        cells = cv2.distanceTransform(padded, cv2.DIST_L2, cv2.DIST_MASK_5)[1:-1, 1:-1]
        return np.asarray(cells * self.depth * np.float32(1 / self.focal[0]), dtype=np.float32)


@numba.njit(cache=True)
def sample_blocks(
    depth: Depth,
    region: tuple[int, int, int, int],
    lens: tuple[float, float, float, float],
    near: float,
    far: float,
    stride: int,
    nodes: Depth,
    points: Array,
) -> None:
    """Mean depth of the nearest surface of each block into `nodes`, its middle into `points`; 0 where less than a
    quarter of the block is within reach. Looks at every second pixel both ways where blocks are large enough.
    """
    left, top, right, bottom = region
    fx, fy, cx, cy = lens
    jump, near32, far32 = np.float32(MAX_JUMP), np.float32(near), np.float32(far)
    step = 1 if stride < 4 else 2
    rows, columns = nodes.shape
    for i in range(rows):
        v0, v1 = top + i * stride, min(top + (i + 1) * stride, bottom)
        for j in range(columns):
            u0, u1 = left + j * stride, min(left + (j + 1) * stride, right)
            nearest, farthest, total, count, size = far32, near32, np.float32(0), 0, 0
            for v in range(v0, v1, step):
                for u in range(u0, u1, step):
                    z = depth[v, u]
                    size += 1
                    if near32 <= z <= far32:
                        count += 1
                        total += z
                        nearest, farthest = min(nearest, z), max(farthest, z)
            mean = 0.0
            if count > 0 and 4 * count >= size:
                mean = float(total) / count
            if mean > 0 and farthest > nearest + jump:
                total, close = np.float32(0), np.float32(0)
                for v in range(v0, v1, step):
                    for u in range(u0, u1, step):
                        z = depth[v, u]
                        if nearest <= z <= nearest + jump:
                            total += z
                            close += 1
                mean = float(total) / float(close)
            nodes[i, j] = mean
            # The block's middle, whatever part of it lies outside the region.
            middle = (stride - 1) / 2
            points[i * columns + j, 0] = (u0 + middle - cx) / fx * mean
            points[i * columns + j, 1] = (v0 + middle - cy) / fy * mean
            points[i * columns + j, 2] = mean


@numba.njit(cache=True)
def label_surfaces(depth: Depth, labels: NDArray[np.int32], squares: Array) -> int:
    """Number the connected surfaces of the grid from 0, into `labels` (-1 where there is none); returns how many.

    The sum of each one's squared depths (m^2) goes into `squares`, as long as there are nodes.
    """
    rows, columns = depth.shape
    jump = np.float32(MAX_JUMP)
    z, label = depth.ravel(), labels.ravel()
    stack = np.empty(z.size, dtype=np.int32)
    label[:] = -1
    count = 0
    for start in range(z.size):
        if z[start] <= 0 or label[start] >= 0:
            continue
        label[start] = count
        stack[0] = start
        size = 1
        squares[count] = 0
        while size > 0:
            size -= 1
            here = stack[size]
            squares[count] += z[here] * z[here]
            i, j = here // columns, here % columns
            for k in range(max(i - 1, 0), min(i + 2, rows)):
                for m in range(max(j - 1, 0), min(j + 2, columns)):
                    there = k * columns + m
                    if label[there] < 0 and z[there] > 0 and abs(z[there] - z[here]) < jump:
                        label[there] = count
                        stack[size] = there
                        size += 1
        count += 1
    return count


@numba.njit(cache=True)
def spread(
    depth: Depth,
    points: Array,
    sources: Index,
    limit: float,
    distance: Depth,
    parent: NDArray[np.int32],
) -> None:
    """Shortest distances (m) along the surface from `sources` (flat node indices), up to `limit`.

    Lowers `distance` in place where a shorter path is found, so that sources can be added to an earlier result; start
    with infinity. `parent` receives the node before each on its path, itself for sources. Dijkstra's algorithm with a
    bucket queue; a node is taken up again when a bucket's inexact order made it too long at first.
    """
    rows, columns = depth.shape
    jump, limit32, per_bucket = np.float32(MAX_JUMP), np.float32(limit), np.float32(1 / BUCKET)
    z, far, before = depth.ravel(), distance.ravel(), parent.ravel()
    head = np.full(int(limit / BUCKET) + 2, -1, dtype=np.int32)
    queue = np.empty((2 * z.size + sources.size + 16, 2), dtype=np.int32)
    keys = np.empty(queue.shape[0], dtype=np.float32)
    free = 0
    for s in sources:
        if z[s] > 0:
            far[s], before[s] = 0, s
            queue[free, 0], queue[free, 1], keys[free] = s, head[0], 0
            head[0] = free
            free += 1
    for bucket in range(head.size):
        while head[bucket] >= 0:
            entry = head[bucket]
            head[bucket] = queue[entry, 1]
            node = queue[entry, 0]
            here = far[node]
            if here < keys[entry]:
                continue  # a shorter path was queued later
            i, j = node // columns, node % columns
            for k in range(max(i - 1, 0), min(i + 2, rows)):
                for m in range(max(j - 1, 0), min(j + 2, columns)):
                    other = k * columns + m
                    if z[other] <= 0 or far[other] <= here or abs(z[other] - z[node]) >= jump:
                        continue
                    dx = points[other, 0] - points[node, 0]
                    dy = points[other, 1] - points[node, 1]
                    dz = points[other, 2] - points[node, 2]
                    there = here + np.float32(np.sqrt(dx * dx + dy * dy + dz * dz))
                    if there < far[other] and there <= limit32:
                        far[other], before[other] = there, node
                        if free == keys.size:
                            queue, keys = np.concatenate((queue, queue)), np.concatenate((keys, keys))
                        b = int(there * per_bucket)
                        queue[free, 0], queue[free, 1], keys[free] = other, head[b], there
                        head[b] = free
                        free += 1
