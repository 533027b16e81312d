"""Markers as a function of the pose and of the hand's sizes, with its exact Jacobian.

The sizes are the 35 parameters of `hand.size_parameters`, relative to the hand of the model. A marker moves with the
skin: its offset stretches along the bone with the length, across it with the width, and on the palm with the palm.
"""

import math
from typing import NamedTuple

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.hand.compiled_kinematics import BodyPoses, Chain, forward_kinematics
from depthtrack.hand.shape import HandShape
from depthtrack.hand.size_parameters import COUNT, KNUCKLES, LENGTHS, PALM, THUMB_BASE, WIDTHS
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.types import Array, Index

_LENGTHS, _WIDTHS, _PALM = LENGTHS.start, WIDTHS.start, PALM.start
_KNUCKLES, _THUMB = KNUCKLES.start, THUMB_BASE.start
COLUMNS = 26 + COUNT
"""Parameters of the Jacobian: the tangent space of the pose, then the sizes."""


class SizedMarkers(NamedTuple):
    """Markers on a hand whose sizes may change.

    bodies: (M,).
    offsets: (M, 3) metres, body frames, of the hand of the model.
    bases: (5, 3) base joints of that hand, scaled, of its side; lengths: (5, 3) of its phalanges, scaled.
    scale: of that hand.
    chain: kinematics of the sizes last set by `set_sizes`.
    local: (M, 3) offsets of these sizes.
    """

    bodies: Index
    offsets: Array
    bases: Array
    lengths: Array
    scale: float
    chain: Chain
    local: Array

    @staticmethod
    def of(model: MarkerModel) -> "SizedMarkers":
        """Return the markers of a model; those of a rigid body are on the palm of any hand."""
        hand = HandShape() if model.hand is None else model.hand
        chain = Chain.of(hand)
        return SizedMarkers(
            np.array(model.bodies),
            np.array(model.offsets),
            chain.base[:, :, 3].copy(),
            chain.lengths.copy(),
            float(hand.scale),
            Chain(chain.base.copy(), chain.lengths.copy(), chain.mirror),
            np.array(model.offsets),
        )


@compiled(nogil=True)
def set_sizes(markers: SizedMarkers, sizes: Array) -> None:
    """Set chain and offsets to those of sizes (35,)."""
    whole = math.exp(sizes[0])
    stretch = np.exp(sizes[_PALM : _PALM + 3])
    step = whole * markers.scale
    for f in range(5):
        for i in range(2):
            markers.chain.base[f, i, 3] = whole * stretch[i] * markers.bases[f, i]
        markers.chain.base[f, 2, 3] = whole * markers.bases[f, 2]
        for k in range(3):
            markers.chain.lengths[f, k] = whole * markers.lengths[f, k] * math.exp(sizes[_LENGTHS + 3 * f + k])
        if f == 0:
            markers.chain.base[0, 0, 3] += step * markers.chain.mirror * sizes[_THUMB]
            markers.chain.base[0, 1, 3] += step * sizes[_THUMB + 1]
            markers.chain.base[0, 2, 3] += step * sizes[_THUMB + 2]
        else:
            markers.chain.base[f, 0, 3] += step * markers.chain.mirror * sizes[_KNUCKLES + 2 * f - 2]
            markers.chain.base[f, 1, 3] += step * sizes[_KNUCKLES + 2 * f - 1]
    for i in range(markers.bodies.shape[0]):
        x, y, z = offset_stretch(sizes, markers.bodies[i])
        markers.local[i, 0] = x * markers.offsets[i, 0]
        markers.local[i, 1] = y * markers.offsets[i, 1]
        markers.local[i, 2] = z * markers.offsets[i, 2]


@compiled(nogil=True)
def offset_stretch(sizes: Array, body: int) -> tuple[float, float, float]:
    """Return the factors of an offset on a body, in its frame, for sizes (35,)."""
    whole = math.exp(sizes[0])
    if body == 0:
        stretch = sizes[_PALM : _PALM + 3]
        return whole * math.exp(stretch[0]), whole * math.exp(stretch[1]), whole * math.exp(stretch[2])
    across = whole * math.exp(sizes[_WIDTHS + (body - 1) // 3])
    return across, whole * math.exp(sizes[_LENGTHS + body - 1]), across


@compiled(nogil=True)
def place_markers(markers: SizedMarkers, bodies: BodyPoses, pose: Array, out: Array) -> None:
    """Write the markers of a pose (27,) to `out` (M, 3), metres, capture frame.

    bodies: receive the hand.
    """
    forward_kinematics(markers.chain, pose, bodies)
    for i in range(markers.bodies.shape[0]):
        T, x = bodies.T[markers.bodies[i]], markers.local[i]
        for j in range(3):
            out[i, j] = T[j, 0] * x[0] + T[j, 1] * x[1] + T[j, 2] * x[2] + T[j, 3]


@compiled(nogil=True)
def marker_jacobian(markers: SizedMarkers, bodies: BodyPoses, i: int, point: Array, sizes: Array, out: Array) -> None:
    """Write the Jacobian (3, 61) of marker i by pose and sizes to `out`.

    bodies, point: as placed by `place_markers`; point (3,) metres, capture frame.
    sizes: (35,) as set by `set_sizes`.

    The columns of the pose are those of `pose.retract`.
    """
    out[:] = 0.0
    T, x, b = bodies.T, markers.local[i], markers.bodies[i]
    a0, a1, a2 = point[0] - T[0, 0, 3], point[1] - T[0, 1, 3], point[2] - T[0, 2, 3]
    out[0, 0] = out[1, 1] = out[2, 2] = 1.0
    out[1, 3], out[2, 3] = -a2, a1
    out[0, 4], out[2, 4] = a2, -a0
    out[0, 5], out[1, 5] = -a1, a0
    out[0, 26], out[1, 26], out[2, 26] = a0, a1, a2
    if b == 0:
        for j in range(3):
            for r in range(3):
                out[r, 26 + _PALM + j] = T[0, r, j] * x[j]
        return
    f, k = (b - 1) // 3, (b - 1) % 3
    for a in range(4 * f, 4 * f + 2 + k):
        u, o = bodies.axes[a], bodies.origins[a]
        d0, d1, d2 = point[0] - o[0], point[1] - o[1], point[2] - o[2]
        out[0, 6 + a] = u[1] * d2 - u[2] * d1
        out[1, 6 + a] = u[2] * d0 - u[0] * d2
        out[2, 6 + a] = u[0] * d1 - u[1] * d0
    whole = math.exp(sizes[0])
    step = whole * markers.scale
    grown_x = whole * math.exp(sizes[_PALM]) * markers.bases[f, 0]
    grown_y = whole * math.exp(sizes[_PALM + 1]) * markers.bases[f, 1]
    column = 26 + (_THUMB if f == 0 else _KNUCKLES + 2 * f - 2)
    for r in range(3):
        out[r, 26 + _PALM] = T[0, r, 0] * grown_x
        out[r, 26 + _PALM + 1] = T[0, r, 1] * grown_y
        out[r, column] = T[0, r, 0] * markers.chain.mirror * step
        out[r, column + 1] = T[0, r, 1] * step
        if f == 0:
            out[r, column + 2] = T[0, r, 2] * step
        for j in range(k):
            out[r, 26 + _LENGTHS + 3 * f + j] = T[1 + 3 * f + j, r, 1] * markers.chain.lengths[f, j]
        out[r, 26 + _LENGTHS + 3 * f + k] = T[b, r, 1] * x[1]
        out[r, 26 + _WIDTHS + f] = T[b, r, 0] * x[0] + T[b, r, 2] * x[2]
