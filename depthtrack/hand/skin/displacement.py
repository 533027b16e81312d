"""Displacement of one person's skin along its normals.

Sizes leave open how thick the flesh is around each bone. The displacement is a function on the skin, linear between the
nodes of a grid on each finger and on the palm. Displacements of a template follow Taylor et al., "User-specific hand
modeling from monocular depth sequences", CVPR 2014; a grid instead of vertices keeps hand files short.

All coordinates are a right hand's of scale 1. Nodes around a bone begin at its x axis; its z axis (palmar) is next.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array

from depthtrack.compilation import compiled
from depthtrack.hand.compiled_kinematics import BODY_COUNT
from depthtrack.hand.displacement_grid import ALONG, AROUND, NODES, PALM_ALONG, PALM_AROUND, PALM_FIRST
from depthtrack.hand.shape import HandShape
from depthtrack.types import Array, Index

TOUCHED = 4
"""Number of nodes that a point of one body depends on."""


class DisplacementGrid(NamedTuple):
    """Places of the nodes on a hand.

    lengths: (15,) of the phalanges, m.
    low, high: places of the first and the last nodes along the palm, m.
    half_breadth, half_thickness: of the palm, m.
    """

    lengths: Array
    low: float
    high: float
    half_breadth: float
    half_thickness: float

    @staticmethod
    def of(shape: HandShape) -> "DisplacementGrid":
        """Return the grid on a hand of these sizes."""
        wrist, knuckles = -shape.palm_length / 2, float(shape.bases[1:, 1].mean())
        return DisplacementGrid(
            np.ascontiguousarray(shape.lengths.ravel()),
            wrist,
            knuckles,
            shape.palm_breadth / 2,
            shape.palm_thickness / 2,
        )


@compiled(nogil=True)
def write_nodes(grid: DisplacementGrid, body: int, x: float, y: float, z: float, nodes: Index, shares: Array) -> None:
    """Write the nodes (4,) that a point depends on, and their shares (4,), which sum to 1.

    x, y, z: the point in the frame of its body, m.
    """
    if body == 0:
        first, rows, columns = PALM_FIRST, PALM_ALONG, PALM_AROUND
        along = (y - grid.low) / (grid.high - grid.low) * (rows - 1)
        angle = math.atan2(z / grid.half_thickness, x / grid.half_breadth)
    else:
        first, rows, columns = (body - 1) // 3 * ALONG * AROUND, ALONG, AROUND
        along = 2.0 * ((body - 1) % 3 + y / grid.lengths[body - 1])
        angle = math.atan2(z, x)
    along = min(max(along, 0.0), rows - 1.0)
    around = angle / (2.0 * math.pi) * columns
    row, column = min(int(along), rows - 2), math.floor(around)
    u, v = along - row, around - column
    left, right = int(column) % columns, (int(column) + 1) % columns
    begun = first + row * columns
    nodes[0], shares[0] = begun + left, (1.0 - u) * (1.0 - v)
    nodes[1], shares[1] = begun + right, (1.0 - u) * v
    nodes[2], shares[2] = begun + columns + left, u * (1.0 - v)
    nodes[3], shares[3] = begun + columns + right, u * v


def displacement_basis(shape: HandShape, rest: Array, weights: Array, T_body_rest: Array) -> csr_array:
    """Return the displacements (V, NODES) of vertices by those of the nodes.

    shape: of scale 1, right.
    rest: (V, 3) metres, palm frame.
    weights: (V, 16) of the bodies.
    T_body_rest: (16, 4, 4) from the palm frame at rest to the frames of the bodies.
    """
    basis = np.zeros((len(rest), NODES))
    _fill(DisplacementGrid.of(shape), rest, weights, T_body_rest, basis)
    return csr_array(basis)


@compiled(nogil=True)
def _fill(grid: DisplacementGrid, rest: Array, weights: Array, T_body_rest: Array, basis: Array) -> None:
    nodes, shares = np.empty(TOUCHED, np.int64), np.empty(TOUCHED)
    for vertex in range(len(rest)):
        p = rest[vertex]
        for body in range(BODY_COUNT):
            weight, T = weights[vertex, body], T_body_rest[body]
            if weight > 0.0:
                x = T[0, 0] * p[0] + T[0, 1] * p[1] + T[0, 2] * p[2] + T[0, 3]
                y = T[1, 0] * p[0] + T[1, 1] * p[1] + T[1, 2] * p[2] + T[1, 3]
                z = T[2, 0] * p[0] + T[2, 1] * p[1] + T[2, 2] * p[2] + T[2, 3]
                write_nodes(grid, body, x, y, z, nodes, shares)
                for k in range(TOUCHED):
                    basis[vertex, nodes[k]] += weight * shares[k]
