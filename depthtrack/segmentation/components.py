"""Connected components of masks, labelled by runs of pixels.

Source: He, Chao and Suzuki, "A run-based two-scan labeling algorithm", IEEE Transactions on Image Processing 2008.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from depthtrack.compilation import compiled
from depthtrack.types import Labels, Mask


class Runs(NamedTuple):
    """Horizontal runs of set pixels, row by row, and their 8-connected components.

    row, begin, end: (N,) row, first column, and column after the last one.
    root: (N,) first run of the same component.
    """

    row: NDArray[np.int32]
    begin: NDArray[np.int32]
    end: NDArray[np.int32]
    root: NDArray[np.int32]


def without_small_components(mask: Mask, share: float) -> Mask:
    """Return a mask (h, w) without 8-connected components below `share` of the largest one."""
    kept = np.zeros(mask.shape, np.bool_)
    _paint_large(np.ascontiguousarray(mask).view(np.uint8), share, kept)
    return kept


def components_with(labels: Labels, seed: int) -> Labels:
    """Return 1 (h, w) on 8-connected components of labels (h, w) that hold the label `seed`.

    Pixels of label 0 belong to none.
    """
    grown = np.zeros(labels.shape, np.uint8)
    _paint_with(labels, seed, grown)
    return grown


@compiled(nogil=True)
def runs_of(labels: Labels) -> Runs:
    """Return the runs of pixels (h, w) that are not 0, and their components."""
    height, width = labels.shape
    most = height * (width // 2 + 1)
    row, begin, end = np.empty(most, np.int32), np.empty(most, np.int32), np.empty(most, np.int32)
    root = np.empty(most, np.int32)
    count, above, above_end = 0, 0, 0
    for v in range(height):
        first, u = count, 0
        while u < width:
            if labels[v, u] == 0:
                u += 1
                continue
            row[count], begin[count], root[count] = v, u, count
            while u < width and labels[v, u] != 0:
                u += 1
            end[count] = u
            # Runs above touch this one also by a corner. The last of them may touch the next one too.
            while above < above_end and end[above] < begin[count]:
                above += 1
            other = above
            while other < above_end and begin[other] <= u:
                _unite(root, other, count)
                other += 1
            above = max(above, other - 1)
            count += 1
        above, above_end = first, count
    for k in range(count):
        root[k] = root[root[k]]
    return Runs(row[:count], begin[:count], end[:count], root[:count])


@compiled(nogil=True)
def _unite(root: NDArray[np.int32], a: int, b: int) -> None:
    """Join the trees of two runs under the root that is earlier."""
    while root[a] != a:
        a = root[a]
    while root[b] != b:
        b = root[b]
    root[max(a, b)] = min(a, b)


@compiled(nogil=True)
def _paint_large(labels: Labels, share: float, out: Mask) -> None:
    """Set the components of at least `share` of the largest one's pixels in `out` (h, w)."""
    runs = runs_of(labels)
    area, largest = np.zeros(runs.root.shape[0], np.int64), 0
    for k in range(runs.root.shape[0]):
        area[runs.root[k]] += runs.end[k] - runs.begin[k]
        largest = max(largest, area[runs.root[k]])
    for k in range(runs.root.shape[0]):
        if area[runs.root[k]] >= share * largest:
            out[runs.row[k], runs.begin[k] : runs.end[k]] = True


@compiled(nogil=True)
def _paint_with(labels: Labels, seed: int, out: Labels) -> None:
    """Set the components that hold a label `seed` to 1 in `out` (h, w)."""
    runs = runs_of(labels)
    holds = np.zeros(runs.root.shape[0], np.bool_)
    for k in range(runs.root.shape[0]):
        for u in range(runs.begin[k], runs.end[k]):
            if labels[runs.row[k], u] == seed:
                holds[runs.root[k]] = True
                break
    for k in range(runs.root.shape[0]):
        if holds[runs.root[k]]:
            out[runs.row[k], runs.begin[k] : runs.end[k]] = 1
