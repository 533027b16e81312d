"""Range of motion of the 20 finger angles.

Sources: ranges of motion of the American Academy of Orthopaedic Surgeons (Greene and Heckman, "The Clinical
Measurement of Joint Motion", 1994) and the reference values of the American Society for Surgery of the Hand
(MCP 0-45 hyperextension to 90, PIP 0-100, DIP 0-80, thumb MCP -10 to 55, thumb IP -15 to 80 degrees); abduction
of the MCP joints as Lin, Wu and Huang, "Modeling the Constraints of Human Hand Motion", 2000 (-15 to 15 degrees),
shifted for index, ring and little finger, whose zero is the middle finger's direction here rather than their own
resting one. The thumb's CMC range (Cooney et al., "The kinesiology of the thumb trapeziometacarpal joint", 1981:
53 degrees flexion-extension, 42 abduction-adduction) is taken about the resting direction of `HandShape`.
"""

import numpy as np
from numpy.typing import ArrayLike

from depthtrack.hand.pose import ANGLES
from depthtrack.types import Array

_DEGREES = np.array(
    [
        # abduction, then three flexions from the palm outward
        [
            (-21, 21),
            (-26, 27),
            (-10, 60),
            (-15, 80),
        ],  # thumb: palmar abduction and flexion about the resting direction
        [(-10, 25), (-20, 90), (0, 110), (0, 80)],  # index: positive abduction leans towards the thumb
        [(-15, 15), (-20, 90), (0, 110), (0, 80)],
        [(-20, 12), (-20, 90), (0, 110), (0, 80)],
        [(-30, 10), (-20, 90), (0, 110), (0, 80)],
    ],
    dtype=np.float64,
)

LOWER: Array = np.radians(_DEGREES[..., 0]).ravel()
"""Smallest value of each finger angle, (20,) radians, in the order of the pose vector."""
UPPER: Array = np.radians(_DEGREES[..., 1]).ravel()
"""Largest value of each finger angle, (20,) radians."""


def within_limits(pose: ArrayLike) -> Array:
    """The pose (..., 27) with every finger angle moved to the nearest point of its range."""
    nearest = np.array(pose, dtype=np.float64)
    nearest[..., ANGLES] = np.clip(nearest[..., ANGLES], LOWER, UPPER)
    return nearest
