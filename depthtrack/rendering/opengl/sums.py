"""The sums of Eq. (2) over tiles read back from the renderer, computed on the CPU."""

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.types import Array, Array32, Index


# Reordered sums vectorise; 0 and infinity keep their IEEE behaviour.
@compiled(nogil=True, error_model="numpy", fastmath={"contract", "nsz", "reassoc"})
def sum_tiles(
    inverse_depth: Array32,
    columns: int,
    regions: Index,
    depth: Array32,
    silhouette: Array32,
    hidden_from: Array32,
    seen_from: Array32,
    empty: tuple[float, float, float],
    match_depth: float,
    clamp_depth: float,
    before_cost: float,
    sums: Array,
) -> None:
    """Write the sums of Eq. (2) of B tiles.

    inverse_depth: (rows, >= columns * w) 1/m, 0 = nothing drawn; tiles of (h, w) pixels.
    regions: (B, 4) the part of each tile that may be drawn, in the order of `geometry.rectangle.Rect`.
    depth: (h, w) metres, 0 = no reading.
    silhouette: (h, w) 0 or 1.
    hidden_from: (h, w) inverse depth, 1/m, that a surface before or inside an occluder exceeds; 0 without one.
    seen_from: (h, w) inverse depth, 1/m, that a surface before the surroundings exceeds; 0 without any.
    before_cost: see `Objective`.
    empty: sums of a tile in which nothing is drawn.
    sums: (B, 3) written: min(|o_d - r_d|, d_M) in metres, pixels of o_s and r_m, pixels of o_s or r_m.
    """
    height, width = depth.shape
    match_, clamp, cost = np.float32(match_depth), np.float32(clamp_depth), np.float32(before_cost)
    zero, one = np.float32(0.0), np.float32(1.0)
    for n in range(regions.shape[0]):
        left, top = n % columns * width, n // columns * height
        u0, u1 = regions[n, 0], regions[n, 2]
        sums[n, 0], sums[n, 1], sums[n, 2] = empty
        for v in range(regions[n, 1], regions[n, 3]):
            drawn_row = inverse_depth[top + v, left + u0 : left + u1]
            depth_row, silhouette_row = depth[v, u0:u1], silhouette[v, u0:u1]
            hidden_row, seen_row = hidden_from[v, u0:u1], seen_from[v, u0:u1]
            clamped, on_silhouette, off_silhouette = zero, zero, zero
            for u in range(u1 - u0):
                w, o, s, behind = drawn_row[u], depth_row[u], silhouette_row[u], hidden_row[u]
                drawn = w > seen_row[u]
                difference = abs(o - one / w)
                change = min(difference, clamp) - min(o, clamp)
                before = cost if (behind > zero) & (w > behind) else zero
                hit = one if drawn & ((difference < match_) | (o == zero)) else zero
                clamped += (change if drawn else zero) + before * clamp
                on_silhouette += hit * s
                off_silhouette += (hit + before) * (one - s)
            sums[n, 0] += clamped
            sums[n, 1] += on_silhouette
            sums[n, 2] += off_silhouette
