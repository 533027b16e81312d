"""Compiled kernels of the surface grid: block means, connected surfaces and shortest paths."""

import numpy as np
from numpy.typing import NDArray

from depthtrack.compilation import compiled
from depthtrack.types import Array, Depth, Index

BUCKET = 0.002
"""Width of a bucket of the shortest-path queue, metres. It affects speed, never the result."""


@compiled()
def sample_blocks(
    depth: Depth,
    region: tuple[int, int, int, int],
    lens: tuple[float, float, float, float],
    near: float,
    far: float,
    stride: int,
    max_jump: float,
    least_share: float,
    nodes: Depth,
    points: Array,
) -> None:
    """Compute the mean depth of the nearest surface of each block.

    depth: (h, w) image, metres.
    region: left, top, right, bottom of the grid in the image, pixels.
    lens: fx, fy, cx, cy of the image, pixels.
    near, far: range of valid depths, metres.
    max_jump: depth range of a surface within a block, metres.
    least_share: share of a block's pixels that must be valid.
    nodes: (rows, columns) output, metres; 0 for blocks with fewer valid pixels.
    points: (rows * columns, 3) output, metres, camera frame: the middles of the blocks at these depths.

    Blocks of 4 pixels or more are sampled at every second row and column.
    """
    left, top, right, bottom = region
    fx, fy, cx, cy = lens
    jump, near32, far32 = np.float32(max_jump), np.float32(near), np.float32(far)
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
            if count > 0 and count >= least_share * size:
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
            # The middle of the whole block, even if a part of it lies outside the region.
            middle = (stride - 1) / 2
            points[i * columns + j, 0] = (u0 + middle - cx) / fx * mean
            points[i * columns + j, 1] = (v0 + middle - cy) / fy * mean
            points[i * columns + j, 2] = mean


@compiled()
def label_surfaces(depth: Depth, max_jump: float, labels: NDArray[np.int32], squares: Array) -> int:
    """Label the connected surfaces of a grid and return their number.

    depth: (rows, columns), metres; 0 without a surface.
    max_jump: depth step between connected neighbours, metres.
    labels: (rows, columns) output, from 0; -1 without a surface.
    squares: (rows * columns,) output, m^2: the sum of squared depths of each surface.
    """
    rows, columns = depth.shape
    jump = np.float32(max_jump)
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


@compiled()
def shortest_paths(
    depth: Depth,
    points: Array,
    max_jump: float,
    sources: Index,
    limit: float,
    distance: Depth,
    parent: NDArray[np.int32],
) -> None:
    """Compute shortest paths along a surface by Dijkstra's algorithm with a bucket queue.

    depth: (rows, columns), metres; 0 without a surface.
    points: (rows * columns, 3), metres, camera frame.
    max_jump: depth step between connected neighbours, metres.
    sources: (S,) flat indices of nodes.
    limit: length of the longest path, metres.
    distance: (rows, columns), metres, infinite without a path; lowered in place if a shorter path exists.
    parent: (rows, columns) flat index of the previous node on the path, set in place; sources are their own parents.

    Sources can be added to an earlier result. A node is processed again if the inexact order within a bucket made its
    path too long at first.
    """
    rows, columns = depth.shape
    jump, limit32, per_bucket = np.float32(max_jump), np.float32(limit), np.float32(1 / BUCKET)
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
