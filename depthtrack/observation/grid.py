"""The visible surface on a coarse grid, where connectivity and distances along the surface are cheap.

A node stands for a block of `stride` x `stride` pixels. Two neighbouring nodes are connected when their depths differ
by less than MAX_JUMP: what lies behind a hand, a face or a chest, is another surface.
"""

from dataclasses import dataclass, replace
from typing import Self

import cv2
import numba
import numpy as np
from numpy.typing import ArrayLike, NDArray

from depthtrack.camera import Camera

MAX_JUMP = 0.03
"""Metres of depth between neighbouring nodes of one surface. A node is about 4 mm wide, so that surfaces turned 80
degrees away from the camera still hold together."""

BUCKET = 0.002
"""Metres; how finely the queue of the shortest-path search is sorted. It affects speed, never the result."""

Depth = NDArray[np.float32]
Mask = NDArray[np.bool_]


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


@dataclass(frozen=True)
class Grid:
    """Nodes (rows, columns) over a depth image, and the grid's own `camera`, whose pixels are the nodes.

    `depth` metres, 0 where a block shows no surface within reach. The block of node (i, j) starts at pixel (j stride,
    i stride).
    """

    depth: Depth
    camera: Camera
    stride: int

    @classmethod
    def over(cls, depth: Depth, camera: Camera, reach: tuple[float, float], stride: int) -> Self:
        """The grid over a depth image (h, w) in metres; only readings within `reach` (nearest, farthest) count."""
        nodes = np.empty((-(-camera.height // stride), -(-camera.width // stride)), dtype=np.float32)
        sample_blocks(depth, reach[0], reach[1], stride, nodes)
        middle = (stride - 1) / 2
        grid_camera = Camera(
            nodes.shape[1],
            nodes.shape[0],
            camera.fx / stride,
            camera.fy / stride,
            (camera.cx - middle) / stride,
            (camera.cy - middle) / stride,
        )
        return cls(nodes, grid_camera, stride)

    @property
    def lens(self) -> tuple[float, float, float, float]:
        """(fx, fy, cx, cy), as the kernels take them."""
        return self.camera.fx, self.camera.fy, self.camera.cx, self.camera.cy

    def points(self, nodes: NDArray[np.integer]) -> NDArray[np.float64]:
        """Camera-frame points (N, 3) of flat node indices (N,)."""
        v, u = np.divmod(nodes, self.depth.shape[1])
        return self.camera.unproject(np.stack([u, v], axis=-1), self.depth.ravel()[nodes])

    def areas(self) -> NDArray[np.float32]:
        """(rows, columns) square metres that a node's block spans across the line of sight."""
        return self.depth * self.depth * np.float32(1 / (self.camera.fx * self.camera.fy))

    def within(self, mask: Mask) -> Self:
        """The same grid with only the nodes of `mask` (rows, columns)."""
        return replace(self, depth=np.where(mask, self.depth, np.float32(0)))

    def surfaces(self) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        """Label (rows, columns) of the connected surface of each node, -1 for none; and areas (S,) in square metres."""
        labels = np.empty(self.depth.shape, dtype=np.int32)
        count = label_surfaces(self.depth, labels)
        areas = np.bincount(labels.ravel() + 1, weights=self.areas().ravel(), minlength=count + 1)[1:]
        return labels, areas

    def paths(self, sources: ArrayLike, limit: float) -> Paths:
        """Shortest paths along the surface from `sources` (flat indices), up to `limit` metres."""
        paths = Paths(np.full(self.depth.shape, np.inf, np.float32), np.full(self.depth.shape, -1, np.int32))
        self.extend(paths, sources, limit)
        return paths

    def extend(self, paths: Paths, sources: ArrayLike, limit: float) -> None:
        """Add `sources` to those that `paths` was made from, in place."""
        spread(self.depth, self.lens, np.asarray(sources, dtype=np.int64), limit, paths.distance, paths.parent)

    def inscribed(self, mask: Mask) -> NDArray[np.float32]:
        """Radius (rows, columns), metres, of the largest circle around each node that stays within `mask`.

        Measured across the line of sight; the window's edge bounds circles too.
        """
        cells = cv2.distanceTransform(np.pad(mask.astype(np.uint8), 1), cv2.DIST_L2, 5)[1:-1, 1:-1]
        return cells * self.depth * np.float32(1 / self.camera.fx)

    def edge(self) -> Mask:
        """(rows, columns): the outermost nodes, through which a surface leaves the window."""
        edge = np.zeros(self.depth.shape, dtype=np.bool_)
        edge[[0, -1], :] = edge[:, [0, -1]] = True
        return edge


@numba.njit(cache=True)
def sample_blocks(depth: Depth, near: float, far: float, stride: int, nodes: Depth) -> None:
    """Mean depth of the nearest surface of each block into `nodes`; 0 where less than a quarter of it is within reach.

    Looks at every second pixel both ways where blocks are large enough.
    """
    jump, near32, far32 = np.float32(MAX_JUMP), np.float32(near), np.float32(far)
    height, width = depth.shape
    step = 1 if stride < 4 else 2
    for i in range(nodes.shape[0]):
        for j in range(nodes.shape[1]):
            nearest, count, size = far32, 0, 0
            for v in range(i * stride, min((i + 1) * stride, height), step):
                for u in range(j * stride, min((j + 1) * stride, width), step):
                    z = depth[v, u]
                    size += 1
                    if near32 <= z <= far32:
                        count += 1
                        nearest = min(nearest, z)
            nodes[i, j] = 0
            if count == 0 or 4 * count < size:
                continue
            total, close = np.float32(0), np.float32(0)
            for v in range(i * stride, min((i + 1) * stride, height), step):
                for u in range(j * stride, min((j + 1) * stride, width), step):
                    z = depth[v, u]
                    if nearest <= z <= nearest + jump:
                        total += z
                        close += 1
            nodes[i, j] = total / close


@numba.njit(cache=True)
def share_of_blocks(mask: NDArray[np.uint8], stride: int, share: NDArray[np.float32]) -> None:
    """Share of each block that `mask` (h, w) covers, into `share` (rows, columns), from the same pixels."""
    height, width = mask.shape
    step = 1 if stride < 4 else 2
    for i in range(share.shape[0]):
        for j in range(share.shape[1]):
            count, size = 0, 0
            for v in range(i * stride, min((i + 1) * stride, height), step):
                for u in range(j * stride, min((j + 1) * stride, width), step):
                    count += mask[v, u] != 0
                    size += 1
            share[i, j] = np.float32(count) / np.float32(size)


@numba.njit(cache=True)
def label_surfaces(depth: Depth, labels: NDArray[np.int32]) -> int:
    """Number the connected surfaces of the grid from 0, into `labels` (-1 where there is none); returns how many."""
    rows, columns = depth.shape
    jump = np.float32(MAX_JUMP)
    stack = np.empty(rows * columns, dtype=np.int32)
    labels[:] = -1
    count = 0
    for start in range(rows * columns):
        if depth.flat[start] <= 0 or labels.flat[start] >= 0:
            continue
        labels.flat[start] = count
        stack[0] = start
        size = 1
        while size > 0:
            size -= 1
            i, j = divmod(stack[size], columns)
            z = depth[i, j]
            for k in range(max(i - 1, 0), min(i + 2, rows)):
                for m in range(max(j - 1, 0), min(j + 2, columns)):
                    if labels[k, m] < 0 and depth[k, m] > 0 and abs(depth[k, m] - z) < jump:
                        labels[k, m] = count
                        stack[size] = k * columns + m
                        size += 1
        count += 1
    return count


@numba.njit(cache=True)
def spread(
    depth: Depth,
    lens: tuple[float, float, float, float],
    sources: NDArray[np.int64],
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
    points = _node_points(depth, lens)
    far, before = distance.ravel(), parent.ravel()
    head = np.full(int(limit / BUCKET) + 2, -1, dtype=np.int32)
    queue = np.empty((2 * rows * columns + sources.size + 16, 2), dtype=np.int32)
    keys = np.empty(queue.shape[0], dtype=np.float32)
    free = 0
    for s in sources:
        if points[s, 2] > 0:
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
            x, y, z = points[node, 0], points[node, 1], points[node, 2]
            for k in range(max(i - 1, 0), min(i + 2, rows)):
                for m in range(max(j - 1, 0), min(j + 2, columns)):
                    other = k * columns + m
                    zo = points[other, 2]
                    if zo <= 0 or far[other] <= here or abs(zo - z) >= jump:
                        continue
                    dx, dy, dz = points[other, 0] - x, points[other, 1] - y, zo - z
                    there = here + np.sqrt(dx * dx + dy * dy + dz * dz)
                    if there < far[other] and there <= limit32:
                        far[other], before[other] = there, node
                        if free == keys.size:
                            queue, keys = np.concatenate((queue, queue)), np.concatenate((keys, keys))
                        b = int(there * per_bucket)
                        queue[free, 0], queue[free, 1], keys[free] = other, head[b], there
                        head[b] = free
                        free += 1


@numba.njit(cache=True)
def _node_points(depth: Depth, lens: tuple[float, float, float, float]) -> Depth:
    """Camera-frame points (rows x columns, 3) of all nodes; z is 0 where there is no surface."""
    rows, columns = depth.shape
    fx, fy, cx, cy = np.float32(lens[0]), np.float32(lens[1]), np.float32(lens[2]), np.float32(lens[3])
    points = np.empty((rows * columns, 3), dtype=np.float32)
    for i in range(rows):
        for j in range(columns):
            z, node = depth[i, j], i * columns + j
            points[node, 0] = (np.float32(j) - cx) / fx * z
            points[node, 1] = (np.float32(i) - cy) / fy * z
            points[node, 2] = z
    return points
