"""Rasteriser kernels: quadrics to inverse depth, sixteen pixels at a time, and Eq. (2).

The buffer holds 0 where nothing is drawn, so the depth test is a maximum. A value that must not be drawn only has to be
0, negative or NaN. Only tiles that a primitive may cover are compared with the observation and cleared again, since
the sums of an empty image are computed once.
"""

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.rendering.raster import hand_constants as constants
from depthtrack.rendering.raster import quadrics as q
from depthtrack.rendering.raster.posing import set_up
from depthtrack.rendering.raster.spans import find_spans
from depthtrack.rendering.raster.tiles import TILE_HEIGHT, TILE_PIXELS, TILE_WIDTH
from depthtrack.rendering.raster.work_queue.queue import complete, pop
from depthtrack.rendering.rendered_surface import NEAR
from depthtrack.simd.functions import (
    bits_of,
    count_bits,
    estimated_reciprocal,
    estimated_reciprocal_sqrt,
    max_or,
    vabs,
    vsum,
)
from depthtrack.simd.vectors import (
    F32X16,
    both,
    filler,
    kernel_part,
    loader,
    select,
    store,
    vmin,
)
from depthtrack.types import Array, Array32, Index, Mask

_load = loader(F32X16)
_fill = filler(F32X16)
_LANE_COLUMN: Array32 = np.arange(TILE_PIXELS, dtype=np.float32) % TILE_WIDTH
_LANE_ROW: Array32 = np.arange(TILE_PIXELS, dtype=np.float32) // TILE_WIDTH
_W_NEAR = np.float32(1 / NEAR)
_TWO, _HEIGHT = np.float32(2.0), np.float32(TILE_HEIGHT)
_ACTIVE = constants.ACTIVE
_LARGE_BOX = 64
"""Tiles of a bounding box above which tighter spans save time."""


@kernel_part
def _draw(slot, is_segment, crosses_near, table, buffer, tile_rows, first, last, low, high):
    """Draw one primitive; extend `low` and `high`, the drawn tile rows of each tile column."""
    left, right = int(table[q.LEFT * q.SLOTS + slot]), int(table[q.RIGHT * q.SLOTS + slot])
    box_top, box_bottom = int(table[q.TOP * q.SLOTS + slot]), int(table[q.BOTTOM * q.SLOTS + slot])
    is_large = (right - left + 1) * (box_bottom - box_top + 1) > _LARGE_BOX and table[q.D_VV * q.SLOTS + slot] < 0.0
    if is_large:
        find_spans(slot, is_segment, table, right - left + 1, box_top, box_bottom, first, last)
    beta, beta_u = table[q.BETA * q.SLOTS + slot], table[q.BETA_U * q.SLOTS + slot]
    d, d_u, d_v = table[q.D * q.SLOTS + slot], table[q.D_U * q.SLOTS + slot], table[q.D_V * q.SLOTS + slot]
    d_uu, d_uv = table[q.D_UU * q.SLOTS + slot], table[q.D_UV * q.SLOTS + slot]
    axis, axis_u = table[q.AXIS * q.SLOTS + slot], table[q.AXIS_U * q.SLOTS + slot]
    beta_v, d_vv = _fill(table[q.BETA_V * q.SLOTS + slot]), _fill(table[q.D_VV * q.SLOTS + slot])
    axis_v = _fill(table[q.AXIS_V * q.SLOTS + slot])
    axis_low, axis_high = _fill(table[q.AXIS_LOW * q.SLOTS + slot]), _fill(table[q.AXIS_HIGH * q.SLOTS + slot])
    sigma = table[q.SIGMA * q.SLOTS + slot]
    line_step, e_step, d_vv_step = beta_v * _HEIGHT, axis_v * _HEIGHT, d_vv * _HEIGHT
    quarter_change = d_vv_step * (_TWO * _HEIGHT)
    is_special = crosses_near or sigma < 0.0
    for tile_column in range(left, right + 1):
        top, bottom = box_top, box_bottom
        if is_large:
            top, bottom = first[tile_column - left], last[tile_column - left]
            if bottom < top:
                continue
        low[tile_column], high[tile_column] = min(low[tile_column], top), max(high[tile_column], bottom)
        # Values that depend on the column alone stay in registers along the tile column.
        x = _load(_LANE_COLUMN, 0) + np.float32((tile_column - left) * TILE_WIDTH)
        column_beta, column_d, column_d_v = x * beta_u + beta, x * (x * d_uu + d_u) + d, x * d_uv + d_v
        column_axis = x * axis_u + axis
        # Polynomials of the row advance by their differences, which are additions beside the products below.
        y = _load(_LANE_ROW, 0) + np.float32((top - box_top) * TILE_HEIGHT)
        quarter, line, e = y * (y * d_vv + column_d_v) + column_d, y * beta_v + column_beta, y * axis_v + column_axis
        quarter_step = (y * _TWO + _HEIGHT) * d_vv_step + column_d_v * _HEIGHT
        start = (tile_column * tile_rows + top) * TILE_PIXELS
        for index in range(start, start + (bottom - top + 1) * TILE_PIXELS, TILE_PIXELS):
            # A Newton step: with r near 1 / sqrt(D / 4), sqrt(D) is D / 4 r (3 - D / 4 r^2). NaN where D <= 0.
            r = estimated_reciprocal_sqrt(quarter)
            half = quarter * r
            correction = np.float32(3.0) - half * r
            if is_special:
                w = half * sigma * correction + line
                w = select(w < _W_NEAR, w, 0.0)
            else:
                w = half * correction + line
            if is_segment:
                w = vmin(w, vmin(e - w * axis_low, w * axis_high - e))
                e = e + e_step
            store(buffer, index, max_or(w, _load(buffer, index)))
            quarter = quarter + quarter_step
            quarter_step, line = quarter_step + quarter_change, line + line_step


@kernel_part
def _draw_hand(pose, hand, camera, scratch, table, buffer, first, last, low, high):
    """Draw all primitives into a cleared buffer; return the number of tile rows."""
    tile_rows = buffer.shape[0] // (low.shape[0] * TILE_PIXELS)
    set_up(pose, hand, camera, scratch, table)
    crosses_near = pose[2] < hand[8 * constants.BOUNDING_RADIUS] + NEAR
    for n in range(_ACTIVE.shape[0]):
        slot = _ACTIVE[n]
        if slot < constants.CONES or slot > constants.GENERAL:
            _draw(slot, False, crosses_near, table, buffer, tile_rows, first, last, low, high)
        else:
            _draw(slot, True, crosses_near, table, buffer, tile_rows, first, last, low, high)
    return tile_rows


@kernel_part
def _compare(is_hiding, observed, labels, hidden_from, seen_from, buffer, tile_rows, low, high, limits):
    """Return how the drawn pixels change the sums of Eq. (2), and clear the buffer.

    Returns the change of the clamped difference, the matched pixels of the silhouette, and all matched pixels. A pixel
    before or inside an occluder counts `Objective.before_cost` times more, as outside the silhouette.

    limits: d_m, d_M, metres; `Objective.before_cost`.
    """
    match_depth, clamp_depth, before_cost = limits
    on_silhouette, matched, hits_before = 0, 0, 0
    clamped, nothing, one = _fill(np.float32(0.0)), _fill(np.float32(0.0)), _fill(np.float32(1.0))
    for tile_column in range(low.shape[0]):
        top, bottom = low[tile_column], high[tile_column]
        low[tile_column], high[tile_column] = tile_rows, -1
        start = (tile_column * tile_rows + top) * TILE_PIXELS
        # Partial sums a column: one long float32 sum over a large image would lose the energy's third digit.
        in_column = nothing
        for index in range(start, start + (bottom - top + 1) * TILE_PIXELS, TILE_PIXELS):
            w = _load(buffer, index)
            o = _load(observed, index)
            drawn = w > (_load(seen_from, index) if is_hiding else nothing)
            z = estimated_reciprocal(w)
            z = z + z * (one - w * z)
            difference = vabs(o - z)
            # Outside the image (o = NaN) both minima are the clamp, and nothing matches.
            in_column = in_column + select(drawn, vmin(difference, clamp_depth) - vmin(o, clamp_depth), 0.0)
            # Pixels are counted as bits. A missing reading matches every drawn pixel.
            label = labels[index // TILE_PIXELS]
            hit = bits_of(drawn) & (bits_of(difference < match_depth) | label >> TILE_PIXELS)
            matched += count_bits(hit)
            on_silhouette += count_bits(hit & label)
            if is_hiding:
                behind = _load(hidden_from, index)
                before = both(behind > 0.0, w > behind)
                in_column = in_column + select(before, _fill(before_cost * clamp_depth), 0.0)
                hits_before += count_bits(bits_of(before) & ~label)
            store(buffer, index, nothing)
        clamped = clamped + in_column
    return vsum(clamped), on_silhouette, matched + before_cost * hits_before


@compiled(nogil=True, _nrt=False)
def score_poses(
    poses: Array,
    tickets: Index,
    thread: int,
    spin_limit: int,
    hand: Array,
    camera: Array,
    observed: Array32,
    labels: Index,
    is_hiding: Mask,
    hidden_from: Array32,
    seen_from: Array32,
    empty: Array,
    objective: Array,
    scratch: Array,
    table: Array32,
    buffer: Array32,
    first: Index,
    last: Index,
    low: Index,
    high: Index,
    sums: Array,
    energies: Array,
    agreements: Array,
) -> None:
    """Score the poses of a batch that `tickets` assigns to this thread.

    poses: (B, 27) metres, quaternion, radians, camera frame.
    tickets, thread, spin_limit: see `queue.pop`, which also states when this returns.
    hand, camera: see `posing.set_up`.
    observed: depth, metres, tiled; 0 = no reading, NaN outside the image.
    labels: see `tiles.write_labels`.
    is_hiding: (1,) whether any pixel of `hidden_from` or `seen_from` is not 0.
    hidden_from: inverse depth, 1/m, that a surface before or inside an occluder exceeds, tiled; 0 without one.
    seen_from: inverse depth, 1/m, that a surface before the surroundings exceeds, tiled; 0 without any.
    empty: (3,) sums of Eq. (2) for an empty image.
    objective: (7,) d_m, d_M, depth unit, epsilon, lambda, lambda_k, `Objective.before_cost`.
    sums, energies: (B, 3) and (B,) of Oikonomidis et al. 2011, Eq. (2) and (1), written.
    agreements: (B,) 1 minus the silhouette term of Eq. (2), written.

    Other threads call this with the same batch, each with its own workspace. It holds `scratch` and `table` (see
    `posing.set_up`); `buffer`, tiled, all 0; `first` and `last`, one element a tile column and one more.
    `low` and `high` have one element a tile column: the number of tile rows, and -1.
    """
    limits = np.float32(objective[0]), np.float32(objective[1]), np.float32(objective[6])
    while True:
        n = pop(tickets, thread, spin_limit)
        if n < 0:
            break
        tile_rows = _draw_hand(poses[n], hand, camera, scratch, table, buffer, first, last, low, high)
        # Constant arguments compile to two loops: the one without them does not read the maps of what hides.
        if is_hiding[0]:
            clamped, on_silhouette, matched = _compare(
                True, observed, labels, hidden_from, seen_from, buffer, tile_rows, low, high, limits
            )
        else:
            clamped, on_silhouette, matched = _compare(
                False, observed, labels, hidden_from, seen_from, buffer, tile_rows, low, high, limits
            )
        sums[n, 0] = empty[0] + clamped
        sums[n, 1] = on_silhouette
        sums[n, 2] = empty[2] + matched - on_silhouette
        energies[n], agreements[n] = _energy(poses[n], sums[n], objective)
        complete(tickets, thread)


@kernel_part
def _energy(pose, sums, objective):
    """Return energy and agreement from the sums of Eq. (2), like `objective.Terms.of_sums`."""
    depth = sums[0] / objective[2] / (sums[2] + objective[3])
    total = sums[1] + sums[2]
    silhouette = 1.0 - 2.0 * sums[1] / total if total > 0.0 else 1.0
    crossing = 0.0
    for finger in range(1, 4):
        phi = pose[7 + 4 * finger] - pose[11 + 4 * finger]
        crossing -= min(phi, 0.0)
    return depth + objective[4] * silhouette + objective[5] * crossing, 1.0 - silhouette


@compiled(nogil=True, _nrt=False)
def draw_pose(
    pose: Array,
    hand: Array,
    camera: Array,
    scratch: Array,
    table: Array32,
    buffer: Array32,
    first: Index,
    last: Index,
    low: Index,
    high: Index,
) -> None:
    """Draw the inverse depth of one pose, 1/m, into the buffer, which the caller clears.

    Arrays are those of `score_poses`.
    """
    tile_rows = _draw_hand(pose, hand, camera, scratch, table, buffer, first, last, low, high)
    low[:], high[:] = tile_rows, -1
