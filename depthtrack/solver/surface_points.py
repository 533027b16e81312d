"""Points of a hand's surface, posed by linear blend skinning, eight at a time.

Points that the same bodies move are neighbours, so that eight of them share the elements of their matrices.
"""

from typing import NamedTuple

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.hand.compiled_kinematics import BODY_COUNT, BodyPoses
from depthtrack.simd.functions import vsqrt
from depthtrack.simd.vectors import F64X8, kernel_part, loader, store, vmax
from depthtrack.types import Array, Index, Mask

LANES = F64X8.lanes
_load = loader(F64X8)


class SurfacePoints(NamedTuple):
    """Points of a hand's surface at rest.

    rest, normals: (V, 3) points and outward unit normals, metres, rest frame.
    bodies, weights: (V, 4) bodies that move each point and their weights, largest first.
    T_body_rest: (16, 3, 4) rest frame to body frames.
    """

    rest: Array
    normals: Array
    bodies: Index
    weights: Array
    T_body_rest: Array


class PointBlocks(NamedTuple):
    """Points of a surface in blocks of eight, each of points that the same bodies move.

    movers: (B, 4) bodies of a block.
    counts: (B,) number of these bodies.
    weights: (4, P) weights of the points, in the order of `movers`.
    rest: (6, P) points, metres, rest frame, and outward unit normals. Padding repeats a point, and has no normal.
    body: (P,) body with the largest weight.
    row: (P,) row of `SurfacePoints`, -1 for padding.
    T_body_rest: (16, 3, 4) rest frame to body frames.
    """

    movers: Index
    counts: Index
    weights: Array
    rest: Array
    body: Index
    row: Index
    T_body_rest: Array

    @staticmethod
    def of(points: SurfacePoints) -> "PointBlocks":
        """Return the points of a surface in blocks; those of a block keep their order."""
        share = np.zeros((len(points.rest), BODY_COUNT))
        np.add.at(share, (np.arange(len(share))[:, None], points.bodies), points.weights)
        sets, member = np.unique(share > 0, axis=0, return_inverse=True)
        movers, rows, padding = np.zeros((len(sets), 4), np.int64), list[Index](), list[Mask]()
        for number, used in enumerate(sets):
            found = np.flatnonzero(member.reshape(-1) == number)
            missing = -len(found) % LANES
            rows.append(np.append(found, np.repeat(found[-1:], missing)))
            padding.append(np.arange(len(found) + missing) >= len(found))
            movers[number, : used.sum()] = np.flatnonzero(used)
        row, unused = np.concatenate(rows), np.concatenate(padding)
        blocks = [len(each) // LANES for each in rows]
        counts, padded = np.repeat(sets.sum(axis=1), blocks), np.repeat(movers, blocks, axis=0)
        weights = np.take_along_axis(share[row], np.repeat(padded, LANES, axis=0), axis=1)
        rest = np.column_stack([points.rest[row], points.normals[row]])
        rest[unused, 3:] = 0.0
        return PointBlocks(
            padded,
            counts,
            np.ascontiguousarray(weights.T),
            np.ascontiguousarray(rest.T),
            np.ascontiguousarray(points.bodies[row, 0]),
            np.where(unused, -1, row),
            np.ascontiguousarray(points.T_body_rest),
        )


@compiled(nogil=True)
def pose_blocks(blocks: PointBlocks, bodies: BodyPoses, out: Array) -> None:
    """Write the posed points and outward unit normals to `out` (6, P), metres, camera frame.

    Padding has no normal, so that it is not visible.
    """
    A = np.empty((BODY_COUNT, 12))
    for b in range(BODY_COUNT):
        T, R = bodies.T[b], blocks.T_body_rest[b]
        for i in range(3):
            for j in range(4):
                A[b, 4 * i + j] = T[i, 0] * R[0, j] + T[i, 1] * R[1, j] + T[i, 2] * R[2, j]
            A[b, 4 * i + 3] += T[i, 3]
    for g in range(blocks.counts.shape[0]):
        _pose_block(blocks, A, g, out)


@kernel_part
def _pose_block(blocks: PointBlocks, A: Array, g: int, out: Array) -> None:
    """Write the posed points of block g.

    A: (16, 12) rest frame to camera frame.
    """
    weights, at = blocks.weights, LANES * g
    w, a = _load(weights[0], at), A[blocks.movers[g, 0]]
    m0, m1, m2, m3 = w * a[0], w * a[1], w * a[2], w * a[3]
    m4, m5, m6, m7 = w * a[4], w * a[5], w * a[6], w * a[7]
    m8, m9, m10, m11 = w * a[8], w * a[9], w * a[10], w * a[11]
    for k in range(1, blocks.counts[g]):
        w, a = _load(weights[k], at), A[blocks.movers[g, k]]
        m0, m1, m2, m3 = m0 + w * a[0], m1 + w * a[1], m2 + w * a[2], m3 + w * a[3]
        m4, m5, m6, m7 = m4 + w * a[4], m5 + w * a[5], m6 + w * a[6], m7 + w * a[7]
        m8, m9, m10, m11 = m8 + w * a[8], m9 + w * a[9], m10 + w * a[10], m11 + w * a[11]
    rest = blocks.rest
    x, y, z = _load(rest[0], at), _load(rest[1], at), _load(rest[2], at)
    store(out[0], at, m0 * x + m1 * y + m2 * z + m3)
    store(out[1], at, m4 * x + m5 * y + m6 * z + m7)
    store(out[2], at, m8 * x + m9 * y + m10 * z + m11)
    x, y, z = _load(rest[3], at), _load(rest[4], at), _load(rest[5], at)
    nx, ny, nz = m0 * x + m1 * y + m2 * z, m4 * x + m5 * y + m6 * z, m8 * x + m9 * y + m10 * z
    scale = 1.0 / vsqrt(vmax(nx * nx + ny * ny + nz * nz, 1e-30))
    store(out[3], at, nx * scale)
    store(out[4], at, ny * scale)
    store(out[5], at, nz * scale)
