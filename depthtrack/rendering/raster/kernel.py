"""The rasteriser: quadrics into an inverse depth buffer, sixteen pixels at a time, then the sums of Eq. (2).

The buffer holds 0 where nothing is drawn, so the depth test is a maximum. Only spans that something covered are
compared with the observation and cleared again; what an empty image would cost is known beforehand.
"""

import numba
import numpy as np
from numpy.typing import NDArray

from depthtrack.rendering.raster import layout
from depthtrack.rendering.raster import quadrics as q
from depthtrack.rendering.raster.posing import set_up
from depthtrack.rendering.raster.simd import (
    F32X16,
    both,
    fetch_add,
    filler,
    loader,
    select,
    store,
    vabs,
    vhighest,
    vlowest,
    vmax,
    vmin,
    vsqrt,
    vsum,
)
from depthtrack.rendering.surface import NEAR

Array = NDArray[np.float64]
Array32 = NDArray[np.float32]

BLOCK = 16
"""Pixels handled at once; rows of the buffer are padded by as many."""

_load = loader(F32X16)
_fill = filler(F32X16)
_IOTA: Array32 = np.arange(BLOCK, dtype=np.float32)
_W_NEAR = np.float32(1 / NEAR)
_ACTIVE = layout.ACTIVE


@numba.njit(cache=True)
def _rows_seen(x, d, d_u, d_v, d_uu, d_uv, d_vv, height):
    """Rows (first, last) in which any column of a block has D >= 0, with a row of slack: the lanes decide exactly."""
    b = x * d_uv + d_v
    discriminant = b * b - (x * (x * d_uu + d_u) + d) * (np.float32(4.0) * d_vv)
    root, half = vsqrt(vmax(discriminant, 0.0)), np.float32(-0.5) / d_vv
    crosses, height = discriminant >= 0.0, np.float32(height)
    first = vlowest(select(crosses, (b - root) * half, height))
    last = vhighest(select(crosses, (b + root) * half, np.float32(-1.0)))
    return int(max(first - np.float32(1.0), np.float32(0.0))), int(min(last + np.float32(1.0), height))


@numba.njit(cache=True)
def _draw(slot, is_segment, table, buffer, stride, low, high, iota):
    """Draw one primitive; `low` and `high` (rows,) keep the columns covered so far."""
    u_low, u_high = int(table[q.U_LOW * q.SLOTS + slot]), int(table[q.U_HIGH * q.SLOTS + slot])
    v_low, v_high = int(table[q.V_LOW * q.SLOTS + slot]), int(table[q.V_HIGH * q.SLOTS + slot])
    if u_high < u_low:
        return
    beta, beta_u = table[q.BETA * q.SLOTS + slot], table[q.BETA_U * q.SLOTS + slot]
    beta_v = table[q.BETA_V * q.SLOTS + slot]
    d, d_u, d_v = table[q.D * q.SLOTS + slot], table[q.D_U * q.SLOTS + slot], table[q.D_V * q.SLOTS + slot]
    d_uu, d_uv = table[q.D_UU * q.SLOTS + slot], table[q.D_UV * q.SLOTS + slot]
    d_vv = table[q.D_VV * q.SLOTS + slot]
    sigma = _fill(table[q.SIGMA * q.SLOTS + slot])
    axis, axis_u = table[q.AXIS * q.SLOTS + slot], table[q.AXIS_U * q.SLOTS + slot]
    axis_v = table[q.AXIS_V * q.SLOTS + slot]
    axis_low = _fill(table[q.AXIS_LOW * q.SLOTS + slot])
    axis_high = _fill(table[q.AXIS_HIGH * q.SLOTS + slot])
    beta_v_lanes, d_vv_lanes, axis_v_lanes = _fill(beta_v), _fill(d_vv), _fill(axis_v)
    for u in range(u_low, u_high + 1, BLOCK):
        x = iota + np.float32(u - u_low)
        first, last = 0, v_high - v_low
        if u_high - u_low >= BLOCK and d_vv < 0.0:
            first, last = _rows_seen(x, d, d_u, d_v, d_uu, d_uv, d_vv, last)
        # What depends on the column alone stays in registers down the block's rows.
        column_beta, column_d, column_d_v = x * beta_u + beta, x * (x * d_uu + d_u) + d, x * d_uv + d_v
        column_axis = x * axis_u + axis
        stop = min(u + BLOCK - 1, u_high)
        y = _fill(np.float32(first))
        for v in range(v_low + first, v_low + last + 1):
            low[v], high[v] = min(low[v], u), max(high[v], stop)
            D = y * (y * d_vv_lanes + column_d_v) + column_d
            w = vsqrt(vmax(D, 0.0)) * sigma + (y * beta_v_lanes + column_beta)
            seen = both(D >= 0.0, w < _W_NEAR)
            if is_segment:
                e = y * axis_v_lanes + column_axis
                seen = both(seen, both(e >= w * axis_low, w * axis_high >= e))
            index = v * stride + u
            store(buffer, index, vmax(_load(buffer, index), select(seen, w, 0.0)))
            y = y + np.float32(1.0)


@numba.njit(cache=True)
def draw(pose, hand, camera, scratch, table, buffer, stride, low, high, iota):
    """Draw a whole hand into a cleared buffer, and clear the padding again."""
    set_up(pose, hand, camera, scratch, table)
    width = int(camera[6])
    for n in range(_ACTIVE.shape[0]):
        slot = _ACTIVE[n]
        if slot < layout.CONES or slot > layout.GENERAL:
            _draw(slot, False, table, buffer, stride, low, high, iota)
        else:
            _draw(slot, True, table, buffer, stride, low, high, iota)
    nothing = _fill(np.float32(0.0))
    for v in range(low.shape[0]):
        if high[v] >= low[v]:
            store(buffer, v * stride + width, nothing)


@numba.njit(cache=True)
def _compare(observed, skin, buffer, stride, low, high, match_depth, clamp_depth):
    """What the drawn pixels change in the sums of Eq. (2); clears the buffer on the way.

    Returns the change of the clamped difference, the matched pixels on skin, and all matched pixels.
    """
    clamped, on_skin, matched = _fill(np.float32(0.0)), _fill(np.float32(0.0)), _fill(np.float32(0.0))
    nothing, one, many = _fill(np.float32(0.0)), _fill(np.float32(1.0)), low.shape[0] * stride
    for v in range(low.shape[0]):
        start, stop = low[v], high[v]
        low[v], high[v] = many, -1
        for u in range(start, stop + 1, BLOCK):
            index = v * stride + u
            w = _load(buffer, index)
            o = _load(observed, index)
            drawn = w > 0.0
            difference = vabs(o - one / w)
            clamped = clamped + select(drawn, vmin(difference, clamp_depth) - vmin(o, clamp_depth), 0.0)
            # A missing reading (o = 0) matches anything that is drawn.
            allowed = select(o > 0.0, _fill(match_depth), np.float32(3e38))
            hit = select(both(drawn, difference < allowed), one, 0.0)
            matched = matched + hit
            on_skin = on_skin + hit * _load(skin, index)
            store(buffer, index, nothing)
    return vsum(clamped), vsum(on_skin), vsum(matched)


@numba.njit(cache=True, nogil=True)
def score_poses(
    poses: Array,
    counter: NDArray[np.int64],
    hand: Array,
    camera: Array,
    observed: Array32,
    skin: Array32,
    empty: Array,
    objective: Array,
    scratch: Array,
    table: Array32,
    buffer: Array32,
    low: NDArray[np.int64],
    high: NDArray[np.int64],
    sums: Array,
    energies: Array,
) -> None:
    """Score poses until the shared `counter` runs out of them; several threads may work on one batch.

    `poses` (B, 27); `observed` depth (metres) and `skin` (0 or 1), rows padded to the buffer's stride; `empty` the
    sums of Eq. (2) for an empty image; `objective`: d_m, d_M, unit, epsilon, lambda, lambda_k. Writes `sums` (B, 3) and
    `energies` (B,). `scratch`, `table`, `buffer` (all 0), `low` (all large) and `high` (all -1) are a thread's own.
    """
    stride = observed.shape[0] // low.shape[0]
    match_depth, clamp_depth = np.float32(objective[0]), np.float32(objective[1])
    while True:
        n = fetch_add(counter, 1)
        if n >= poses.shape[0]:
            break
        draw(poses[n], hand, camera, scratch, table, buffer, stride, low, high, _load(_IOTA, 0))
        clamped, on_skin, matched = _compare(observed, skin, buffer, stride, low, high, match_depth, clamp_depth)
        sums[n, 0] = empty[0] + clamped
        sums[n, 1] = on_skin
        sums[n, 2] = empty[2] + matched - on_skin
        energies[n] = _energy(poses[n], sums[n], objective)


@numba.njit(cache=True)
def _energy(pose, sums, objective):
    """Eq. (1) from the sums of Eq. (2), as `objective.Terms.of_sums` does for batches."""
    depth = sums[0] / objective[2] / (sums[2] + objective[3])
    total = sums[1] + sums[2]
    skin = 1.0 - 2.0 * sums[1] / total if total > 0.0 else 1.0
    crossing = 0.0
    for finger in range(1, 4):
        phi = pose[7 + 4 * finger] - pose[11 + 4 * finger]
        crossing -= min(phi, 0.0)
    return depth + objective[4] * skin + objective[5] * crossing


@numba.njit(cache=True, nogil=True)
def render_pose(
    pose: Array,
    hand: Array,
    camera: Array,
    scratch: Array,
    table: Array32,
    buffer: Array32,
    low: NDArray[np.int64],
    high: NDArray[np.int64],
    depth: Array32,
) -> None:
    """Depth (h, w) in metres of one pose, 0 where there is no hand; the scratch arrays as in `score_poses`."""
    stride = buffer.shape[0] // low.shape[0]
    draw(pose, hand, camera, scratch, table, buffer, stride, low, high, _load(_IOTA, 0))
    for v in range(depth.shape[0]):
        for u in range(depth.shape[1]):
            w = buffer[v * stride + u]
            depth[v, u] = np.float32(1.0) / w if w > 0.0 else np.float32(0.0)
        for u in range(stride):
            buffer[v * stride + u] = 0.0
        low[v], high[v] = buffer.shape[0], -1
