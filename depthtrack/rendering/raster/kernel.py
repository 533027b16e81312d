"""The rasteriser: quadrics into an inverse depth buffer, sixteen pixels at a time, then the sums of Eq. (2).

The buffer holds 0 where nothing is drawn, so the depth test is a maximum, and whatever must not be seen only has to
be 0, less, or NaN. Only blocks that something reached are compared with the observation and cleared again; what an
empty image would cost is known beforehand.
"""

import numba
import numpy as np

from depthtrack.rendering.raster import layout
from depthtrack.rendering.raster import quadrics as q
from depthtrack.rendering.raster.posing import set_up
from depthtrack.rendering.raster.spans import find_spans
from depthtrack.rendering.raster.tiles import BLOCK, COLUMNS, ROWS
from depthtrack.rendering.rendered_surface import NEAR
from depthtrack.simd.functions import (
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
from depthtrack.types import Array, Array32, Index

_load = loader(F32X16)
_fill = filler(F32X16)
_LANE_COLUMN: Array32 = np.arange(BLOCK, dtype=np.float32) % COLUMNS
_LANE_ROW: Array32 = np.arange(BLOCK, dtype=np.float32) // COLUMNS
_W_NEAR = np.float32(1 / NEAR)
_ACTIVE = layout.ACTIVE
_LARGE = 64
"""Blocks of a bounding box from which on it pays to find out which of them are needed."""


@kernel_part
def _draw(slot, is_segment, crosses_near, table, buffer, blocks, first, last, low, high):
    """Draw one primitive; `low` and `high` keep the blocks of each stripe that were reached."""
    left, right = int(table[q.LEFT * q.SLOTS + slot]), int(table[q.RIGHT * q.SLOTS + slot])
    box_top, box_bottom = int(table[q.TOP * q.SLOTS + slot]), int(table[q.BOTTOM * q.SLOTS + slot])
    is_large = (right - left + 1) * (box_bottom - box_top + 1) > _LARGE and table[q.D_VV * q.SLOTS + slot] < 0.0
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
    is_special = crosses_near or sigma < 0.0
    for stripe in range(left, right + 1):
        top, bottom = box_top, box_bottom
        if is_large:
            top, bottom = first[stripe - left], last[stripe - left]
            if bottom < top:
                continue
        low[stripe], high[stripe] = min(low[stripe], top), max(high[stripe], bottom)
        # What depends on the column alone stays in registers down the stripe.
        x = _load(_LANE_COLUMN, 0) + np.float32((stripe - left) * COLUMNS)
        column_beta, column_d, column_d_v = x * beta_u + beta, x * (x * d_uu + d_u) + d, x * d_uv + d_v
        column_axis = x * axis_u + axis
        y = _load(_LANE_ROW, 0) + np.float32((top - box_top) * ROWS)
        start = (stripe * blocks + top) * BLOCK
        for index in range(start, start + (bottom - top + 1) * BLOCK, BLOCK):
            # A Newton step: with r near 1 / sqrt(D / 4), sqrt(D) is D / 4 r (3 - D / 4 r^2). NaN where D <= 0.
            quarter = y * (y * d_vv + column_d_v) + column_d
            r = estimated_reciprocal_sqrt(quarter)
            half = quarter * r
            rest, line = np.float32(3.0) - half * r, y * beta_v + column_beta
            if is_special:
                w = half * sigma * rest + line
                w = select(w < _W_NEAR, w, 0.0)
            else:
                w = half * rest + line
            if is_segment:
                e = y * axis_v + column_axis
                w = vmin(w, vmin(e - w * axis_low, w * axis_high - e))
            store(buffer, index, max_or(w, _load(buffer, index)))
            y = y + np.float32(ROWS)


@kernel_part
def _draw_hand(pose, hand, camera, scratch, table, buffer, first, last, low, high):
    """Draw all primitives into a cleared buffer; returns how many blocks a stripe has."""
    blocks = buffer.shape[0] // (low.shape[0] * BLOCK)
    set_up(pose, hand, camera, scratch, table)
    crosses_near = pose[2] < hand[8 * layout.REACH] + NEAR
    for n in range(_ACTIVE.shape[0]):
        slot = _ACTIVE[n]
        if slot < layout.CONES or slot > layout.GENERAL:
            _draw(slot, False, crosses_near, table, buffer, blocks, first, last, low, high)
        else:
            _draw(slot, True, crosses_near, table, buffer, blocks, first, last, low, high)
    return blocks


@kernel_part
def _compare(observed, silhouette, buffer, blocks, low, high, match_depth, clamp_depth):
    """What the drawn pixels change in the sums of Eq. (2); clears the buffer on the way.

    Returns the change of the clamped difference, the matched pixels of the silhouette, and all matched pixels.
    """
    clamped, on_silhouette, matched = _fill(np.float32(0.0)), _fill(np.float32(0.0)), _fill(np.float32(0.0))
    nothing, one = _fill(np.float32(0.0)), _fill(np.float32(1.0))
    for stripe in range(low.shape[0]):
        top, bottom = low[stripe], high[stripe]
        low[stripe], high[stripe] = blocks, -1
        start = (stripe * blocks + top) * BLOCK
        # Summed by the stripe first: one long float32 sum over a large image would lose the energy's third digit.
        in_stripe = nothing
        for index in range(start, start + (bottom - top + 1) * BLOCK, BLOCK):
            w = _load(buffer, index)
            o = _load(observed, index)
            drawn = w > 0.0
            z = estimated_reciprocal(w)
            z = z + z * (one - w * z)
            difference = vabs(o - z)
            # Beyond the image (o = NaN) both minima are the clamp, and nothing matches.
            in_stripe = in_stripe + select(drawn, vmin(difference, clamp_depth) - vmin(o, clamp_depth), 0.0)
            # A missing reading (o = 0) matches anything that is drawn.
            allowed = select(o > 0.0, _fill(match_depth), np.float32(3e38))
            hit = select(both(drawn, difference < allowed), one, 0.0)
            matched = matched + hit
            on_silhouette = on_silhouette + hit * _load(silhouette, index)
            store(buffer, index, nothing)
        clamped = clamped + in_stripe
    return vsum(clamped), vsum(on_silhouette), vsum(matched)


@numba.njit(cache=True, nogil=True, _nrt=False)
def score_poses(
    poses: Array,
    start: int,
    stop: int,
    hand: Array,
    camera: Array,
    observed: Array32,
    silhouette: Array32,
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
) -> None:
    """Score poses `start` to `stop` of a batch.

    `poses` (B, 27) camera frame; `observed` depth (metres, NaN beyond the image) and `silhouette` (0 or 1) in stripes.
    `empty` (3,): the sums of Eq. (2) for an empty image. `objective` (6,): d_m, d_M, unit, epsilon, lambda, lambda_k.
    Writes `sums` (B, 3) and `energies` (B,). Other calls may score other poses of the same batch at the same time,
    if each has arrays of its own for the rest: `scratch`, `table`, `buffer` (stripes, all 0), `first` and `last` (one
    element a stripe and one more), `low` (one a stripe, all large) and `high` (one a stripe, all -1).
    """
    match_depth, clamp_depth = np.float32(objective[0]), np.float32(objective[1])
    for n in range(start, stop):
        blocks = _draw_hand(poses[n], hand, camera, scratch, table, buffer, first, last, low, high)
        clamped, on_silhouette, matched = _compare(
            observed, silhouette, buffer, blocks, low, high, match_depth, clamp_depth
        )
        sums[n, 0] = empty[0] + clamped
        sums[n, 1] = on_silhouette
        sums[n, 2] = empty[2] + matched - on_silhouette
        energies[n] = _energy(poses[n], sums[n], objective)


@kernel_part
def _energy(pose, sums, objective):
    """Eq. (1) from the sums of Eq. (2), as `objective.Terms.of_sums` does for batches."""
    depth = sums[0] / objective[2] / (sums[2] + objective[3])
    total = sums[1] + sums[2]
    silhouette = 1.0 - 2.0 * sums[1] / total if total > 0.0 else 1.0
    crossing = 0.0
    for finger in range(1, 4):
        phi = pose[7 + 4 * finger] - pose[11 + 4 * finger]
        crossing -= min(phi, 0.0)
    return depth + objective[4] * silhouette + objective[5] * crossing


@numba.njit(cache=True, nogil=True, _nrt=False)
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
    """Leave the inverse depth of one pose in the buffer, for the caller to clear; arrays as in `score_poses`."""
    blocks = _draw_hand(pose, hand, camera, scratch, table, buffer, first, last, low, high)
    low[:], high[:] = blocks, -1
