"""Add up the normal equations of a view by pose, sizes and displacement in kernels.

A residual depends on the palm, on one finger, on the sizes of both and on four nodes of the displacement: on 24
parameters at most. Only these are added up.
"""

from typing import NamedTuple

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.hand.compiled_kinematics import BodyPoses
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import TANGENT_SIZE
from depthtrack.hand.shape import HandShape
from depthtrack.hand.size_parameters import COUNT, KNUCKLES, LENGTHS, PALM, THUMB_BASE, WIDTHS
from depthtrack.hand.skin.displacement import TOUCHED, DisplacementGrid, write_nodes
from depthtrack.solver.robust import compiled_geman_mcclure
from depthtrack.types import Array, Index

PARAMETERS = TANGENT_SIZE + COUNT
_LENGTHS, _WIDTHS, _PALM = (TANGENT_SIZE + part.start for part in (LENGTHS, WIDTHS, PALM))
_KNUCKLES, _THUMB_BASE = (TANGENT_SIZE + part.start for part in (KNUCKLES, THUMB_BASE))
_BLOCK = 32
_MOST = 24 + TOUCHED
"""Bound on the parameters that one residual depends on."""
_AVERAGE = HandShape()


class SizedHand(NamedTuple):
    """A posed hand, and how its sizes move it.

    bodies: in the camera frame.
    lengths: (5, 3) of the phalanges, m.
    grown: (5, 3) places of the base joints by the palm's sizes alone, m, palm frame of a hand of scale 1.
    scale, mirror: of the hand.
    grid: of the displacement of its skin.
    """

    bodies: BodyPoses
    lengths: Array
    grown: Array
    scale: float
    mirror: float
    grid: DisplacementGrid

    @staticmethod
    def at(model: HandModel, pose: Array) -> "SizedHand":
        """Return a hand in a pose (27,)."""
        shape = model.shape
        breadth, length = shape.palm_breadth / _AVERAGE.palm_breadth, shape.palm_length / _AVERAGE.palm_length
        grown = _AVERAGE.bases * [breadth, length, 1.0]
        bodies, grid = BodyPoses.at(model.chain, pose), DisplacementGrid.of(shape)
        return SizedHand(bodies, model.lengths, grown, shape.scale, float(shape.mirror), grid)


class Residuals(NamedTuple):
    """Residuals of skin points along directions.

    bodies: (N,).
    x: (N, 3) metres, camera frame.
    directions: (N, 3).
    errors: (N,) m, signed.
    distances: (N,) m, from which the robust weights follow.
    """

    bodies: Index
    x: Array
    directions: Array
    errors: Array
    distances: Array


@compiled(nogil=True)
def write_gradient(hand: SizedHand, b: int, x: Array, n: Array, columns: Index, a: Array) -> int:
    """Write the derivative of a residual by its parameters; return their number.

    b: body of the point.
    x, n: (3,) point, m, and direction of the residual, camera frame.
    columns, a: the parameters that move the point, in increasing order, and the derivatives.

    It is the product of `n` with `HandModel.point_jacobian` and `size_parameters.motion_of`.
    """
    T, axes, origins = hand.bodies.T, hand.bodies.axes, hand.bodies.origins
    px, py, pz = x[0] - T[0, 0, 3], x[1] - T[0, 1, 3], x[2] - T[0, 2, 3]
    for i in range(6):
        columns[i] = i
    a[0], a[1], a[2] = n[0], n[1], n[2]
    a[3], a[4], a[5] = py * n[2] - pz * n[1], pz * n[0] - px * n[2], px * n[1] - py * n[0]
    count, finger, phalanx = 6, (b - 1) // 3, (b - 1) % 3
    if b > 0:
        for angle in range(4 * finger, 4 * finger + 2 + phalanx):
            u, o = axes[angle], origins[angle]
            rx, ry, rz = x[0] - o[0], x[1] - o[1], x[2] - o[2]
            columns[count] = 6 + angle
            a[count] = n[0] * (u[1] * rz - u[2] * ry) + n[1] * (u[2] * rx - u[0] * rz) + n[2] * (u[0] * ry - u[1] * rx)
            count += 1
    columns[count], a[count] = TANGENT_SIZE, n[0] * px + n[1] * py + n[2] * pz
    count += 1
    qx, qy, qz = x[0] - T[b, 0, 3], x[1] - T[b, 1, 3], x[2] - T[b, 2, 3]
    if b == 0:
        for j in range(3):
            local = T[0, 0, j] * qx + T[0, 1, j] * qy + T[0, 2, j] * qz
            columns[count], a[count] = _PALM + j, local * _along(T, 0, j, n)
            count += 1
        return count
    for k in range(phalanx + 1):
        body = b - phalanx + k
        extent = hand.lengths[finger, k] if k < phalanx else T[b, 0, 1] * qx + T[b, 1, 1] * qy + T[b, 2, 1] * qz
        columns[count], a[count] = _LENGTHS + 3 * finger + k, extent * _along(T, body, 1, n)
        count += 1
    across = T[b, 0, 0] * qx + T[b, 1, 0] * qy + T[b, 2, 0] * qz
    deep = T[b, 0, 2] * qx + T[b, 1, 2] * qy + T[b, 2, 2] * qz
    columns[count], a[count] = _WIDTHS + finger, across * _along(T, b, 0, n) + deep * _along(T, b, 2, n)
    sideways, forward = hand.scale * hand.mirror * _along(T, 0, 0, n), hand.scale * _along(T, 0, 1, n)
    columns[count + 1], a[count + 1] = _PALM, hand.grown[finger, 0] * sideways
    columns[count + 2], a[count + 2] = _PALM + 1, hand.grown[finger, 1] * forward
    count += 3
    first = _THUMB_BASE if finger == 0 else _KNUCKLES + 2 * (finger - 1)
    columns[count], a[count] = first, sideways
    columns[count + 1], a[count + 1] = first + 1, forward
    count += 2
    if finger == 0:
        columns[count], a[count] = first + 2, hand.scale * _along(T, 0, 2, n)
        count += 1
    return count


@compiled(nogil=True)
def _write_displacement(hand: SizedHand, b: int, x: Array, columns: Index, a: Array, count: int) -> int:
    """Write the derivatives by the displacement behind `count` others.

    Returns the number of all. The direction of the residual counts as the skin's normal, along which a displacement
    moves the point.
    """
    T, nodes, shares = hand.bodies.T, np.empty(TOUCHED, np.int64), np.empty(TOUCHED)
    qx, qy, qz = x[0] - T[b, 0, 3], x[1] - T[b, 1, 3], x[2] - T[b, 2, 3]
    across = (T[b, 0, 0] * qx + T[b, 1, 0] * qy + T[b, 2, 0] * qz) * hand.mirror / hand.scale
    along = (T[b, 0, 1] * qx + T[b, 1, 1] * qy + T[b, 2, 1] * qz) / hand.scale
    deep = (T[b, 0, 2] * qx + T[b, 1, 2] * qy + T[b, 2, 2] * qz) / hand.scale
    write_nodes(hand.grid, b, across, along, deep, nodes, shares)
    for i in range(TOUCHED):
        at = count + i
        # The nodes are in no order, but the sums need one.
        column, value = PARAMETERS + nodes[i], hand.scale * shares[i]
        while at > count and columns[at - 1] > column:
            columns[at], a[at] = columns[at - 1], a[at - 1]
            at -= 1
        columns[at], a[at] = column, value
    return count + TOUCHED


@compiled(nogil=True)
def _along(T: Array, body: int, axis: int, n: Array) -> float:
    """Return the component of n (3,) along an axis of a body."""
    return float(T[body, 0, axis] * n[0] + T[body, 1, axis] * n[1] + T[body, 2, axis] * n[2])


@compiled(nogil=True)
def add_normal_equations(hand: SizedHand, residuals: Residuals, kernel_scale: float, H: Array, g: Array) -> None:
    """Add the weighted sums of a a^T to the upper triangle of H (61, 61), and of a e to g (61,).

    If H and g have rows for the nodes of the displacement as well, these are added up too.

    a: gradients; e: residuals.
    kernel_scale: m, scale of the Geman-McClure kernel.
    """
    columns, a = np.empty(_MOST, np.int64), np.empty(_MOST)
    for k in range(residuals.bodies.shape[0]):
        count = write_gradient(hand, residuals.bodies[k], residuals.x[k], residuals.directions[k], columns, a)
        if H.shape[0] > PARAMETERS:
            count = _write_displacement(hand, residuals.bodies[k], residuals.x[k], columns, a, count)
        weight = compiled_geman_mcclure(residuals.distances[k] ** 2, kernel_scale)
        for i in range(count):
            share = weight * a[i]
            row = columns[i]
            g[row] += share * residuals.errors[k]
            for j in range(i, count):
                H[row, columns[j]] += share * a[j]


@compiled(nogil=True)
def mirror_upper(H: Array) -> None:
    """Write the upper triangle of H (n, n) to the lower one too, in blocks that the cache holds."""
    n = H.shape[0]
    for top in range(0, n, _BLOCK):
        for left in range(0, top + 1, _BLOCK):
            for i in range(top, min(top + _BLOCK, n)):
                for j in range(left, min(left + _BLOCK, i)):
                    H[i, j] = H[j, i]
