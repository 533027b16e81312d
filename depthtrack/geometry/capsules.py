"""Distance to a tapered capsule, the union of balls along a segment with linear radius.

The surface between the balls is the cone that touches them. Its normal leans towards the thinner end, so the nearest
ball is not the one straight across the axis. Functions take scalars or arrays; the `compiled_` forms serve kernels.
"""

import math

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.types import Array


def nearest_ball(along: Array, across: Array, taper: float, length: float) -> Array:
    """Return the position on the axis, metres from its start, of the ball nearest to points.

    along: metres along the axis from its start.
    across: metres from the axis.
    taper: radius lost per metre of axis, -1 to 1.
    length: metres.
    """
    t = along - across * taper / np.sqrt(1.0 - taper * taper)
    return np.minimum(np.maximum(t, 0.0), length)


def capsule_distance(along: Array, across: Array, radius: float, taper: float, length: float) -> Array:
    """Return the signed distance, metres, of points to a tapered capsule; see `nearest_ball`.

    radius: metres, at the start of the axis.
    """
    t = nearest_ball(along, across, taper, length)
    return np.sqrt((along - t) ** 2 + across**2) - (radius - taper * t)


@compiled(nogil=True, inline="always")
def compiled_nearest_ball(along: float, across: float, taper: float, length: float) -> float:
    """Return `nearest_ball` of one point.

    Inlined, because a call per point takes a quarter of an IK frame.
    """
    t = along - across * taper / math.sqrt(1.0 - taper * taper)
    return min(max(t, 0.0), length)
