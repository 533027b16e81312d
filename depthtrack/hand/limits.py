"""Range of motion of the 20 finger angles.

Sources:
- Flexion: Greene and Heckman, "The Clinical Measurement of Joint Motion", 1994, of the American Academy of Orthopaedic
  Surgeons. Also the reference values of the American Society for Surgery of the Hand, in degrees: MCP 0-45
  hyperextension to 90, PIP 0-100, DIP 0-80, thumb MCP -10 to 55, thumb IP -15 to 80.
- Abduction of the MCP joints: Lin, Wu and Huang, "Modeling the Constraints of Human Hand Motion", 2000: -15 to 15
  degrees. The ranges of index, ring and little finger are shifted, since zero is here the middle finger's direction.
- CMC joint: Cooney et al., "The kinesiology of the thumb trapeziometacarpal joint", 1981. Its ranges, 53 degrees of
  flexion and 42 of abduction, are centred on the resting direction of `HandShape`.
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
"""(20,) smallest finger angles, radians, in the order of the pose vector."""
UPPER: Array = np.radians(_DEGREES[..., 1]).ravel()
"""(20,) largest finger angles, radians."""


def within_limits(pose: ArrayLike) -> Array:
    """Return the pose (..., 27) with every finger angle clipped to its range."""
    nearest = np.array(pose, dtype=np.float64)
    nearest[..., ANGLES] = np.clip(nearest[..., ANGLES], LOWER, UPPER)
    return nearest
