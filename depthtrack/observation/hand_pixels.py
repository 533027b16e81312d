"""From nodes back to pixels: which pixels of a frame belong to the hand that was found on the grid."""

import numba
import numpy as np
from numpy.typing import NDArray

from depthtrack.observation.grid import MAX_JUMP, Depth

ELSEWHERE, HAND, ARM, BESIDE = 0, 1, 2, 4
"""Labels of nodes, one bit each; BESIDE is what hangs together with the hand and is neither hand nor arm."""

NOTHING, MISSING, OTHER, READING = 0, 1, 2, 3
"""Kinds of pixels: far from the hand; without a reading, beside the hand; a reading of what hangs together with the
hand; a reading of the hand."""


@numba.njit(cache=True)
def hand_pixels(
    depth: Depth,
    nodes: Depth,
    labels: NDArray[np.uint8],
    stride: int,
    lens: tuple[float, float, float, float],
    plane: tuple[float, float, float, float],
    out: NDArray[np.uint8],
) -> None:
    """Kind of every pixel of `depth` (h, w; metres), into `out` (h, w).

    `nodes` and `labels` (rows, columns) are the grid's. A reading belongs to the node, of its own block and those
    around it, whose depth is nearest to its own, if that is within MAX_JUMP: to hand or arm if there are any. A pixel
    without a reading belongs to the nearest block. Where arm and hand meet, the plane (a, b, c, d) decides instead:
    the hand is where a x + b y + c z <= d.
    """
    rows, columns = nodes.shape
    height, width = depth.shape
    fx, fy, cx, cy = lens
    a, b, c, d = plane
    jump = np.float32(MAX_JUMP)
    out[:] = NOTHING
    for i in range(rows):
        for j in range(columns):
            k0, k1, m0, m1 = max(i - 1, 0), min(i + 2, rows), max(j - 1, 0), min(j + 2, columns)
            around = 0
            for k in range(k0, k1):
                for m in range(m0, m1):
                    around |= labels[k, m]
            if around == ELSEWHERE:
                continue
            for v in range(i * stride, min((i + 1) * stride, height)):
                for u in range(j * stride, min((j + 1) * stride, width)):
                    z = depth[v, u]
                    if around == HAND == labels[i, j] and abs(nodes[i, j] - z) < jump:
                        out[v, u] = READING  # deep inside the hand
                        continue
                    nearest, close = np.float32(np.inf), np.float32(0)
                    label, met = ELSEWHERE, ELSEWHERE
                    for k in range(k0, k1):
                        for m in range(m0, m1):
                            if labels[k, m] == ELSEWHERE:
                                continue
                            if z > 0:
                                difference = abs(nodes[k, m] - z)
                                if difference >= jump:
                                    continue
                            else:
                                difference = np.float32((k - i) ** 2 + (m - j) ** 2)
                            met |= labels[k, m]
                            if difference < nearest and labels[k, m] != BESIDE:
                                nearest, label, close = difference, labels[k, m], nodes[k, m]
                    hand = bool(label == HAND)
                    if met & (HAND | ARM) == HAND | ARM:
                        if z > 0:
                            close = z
                        hand = bool((a * (u - cx) / fx + b * (v - cy) / fy + c) * close <= d)
                    if z > 0:
                        if met != ELSEWHERE:
                            out[v, u] = READING if hand else OTHER
                    elif hand:
                        out[v, u] = MISSING
