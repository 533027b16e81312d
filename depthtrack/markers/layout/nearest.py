"""Nearest of a few thousand points by a k-d tree (Bentley 1975), compiled."""

from typing import NamedTuple

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.types import Array, Index

_LEAF = 8
"""Most points of a leaf."""


class Tree(NamedTuple):
    """A balanced k-d tree. Node i has the children 2 i + 1 and 2 i + 2.

    points: (V, 3) sorted by leaf.
    rows: (V,) their rows before.
    axis: of each node's split, -1 for a leaf.
    at: coordinate of the split.
    first, last: range of the node's points.
    """

    points: Array
    rows: Index
    axis: Index
    at: Array
    first: Index
    last: Index

    @staticmethod
    def of(points: Array) -> "Tree":
        """Return the tree of points (V, 3)."""
        depth = max(0, int(np.ceil(np.log2(max(len(points), 1) / _LEAF))))
        count = 2 ** (depth + 1) - 1
        rows, axis, at = np.arange(len(points)), np.full(count, -1), np.zeros(count)
        first, last = np.zeros(count, np.int64), np.zeros(count, np.int64)
        last[0] = len(points)
        for node in range(2**depth - 1):
            a, b = first[node], last[node]
            part, middle = rows[a:b], (b - a) // 2
            k = int(np.argmax(np.ptp(points[part], axis=0)))
            part = part[np.argsort(points[part, k], kind="stable")]
            rows[a:b], axis[node], at[node] = part, k, points[part[middle], k]
            first[2 * node + 1], last[2 * node + 1] = a, a + middle
            first[2 * node + 2], last[2 * node + 2] = a + middle, b
        return Tree(np.ascontiguousarray(points[rows]), rows, axis, at, first, last)


@compiled(nogil=True)
def nearest_rows(tree: Tree, queries: Array, out: Index) -> None:
    """Write the row of the point nearest to each query (Q, 3) to `out` (Q,)."""
    stack, bounds = np.empty(64, np.int64), np.empty(64)
    for q in range(queries.shape[0]):
        x, y, z = queries[q, 0], queries[q, 1], queries[q, 2]
        best, chosen, top = np.inf, 0, 1
        stack[0], bounds[0] = 0, 0.0
        while top > 0:
            top -= 1
            node = stack[top]
            if bounds[top] >= best:
                continue
            while tree.axis[node] >= 0:
                k = tree.axis[node]
                over = queries[q, k] - tree.at[node]
                near = 2 * node + 2 if over >= 0 else 2 * node + 1
                stack[top], bounds[top] = 4 * node + 3 - near, over * over
                top += 1
                node = near
            for i in range(tree.first[node], tree.last[node]):
                dx, dy, dz = tree.points[i, 0] - x, tree.points[i, 1] - y, tree.points[i, 2] - z
                square = dx * dx + dy * dy + dz * dz
                if square < best:
                    best, chosen = square, i
        out[q] = tree.rows[chosen]
