"""Second thoughts about a pose that explains little: other fingers, another place close by.

Descents and swarms move a finger through its neighbours' places only with luck: an open finger that is taken for a bent
one, or for the next, stays so for many frames. What other postures would look like, the renderer tells in microseconds.
"""

import numpy as np
from numpy.typing import NDArray

from depthtrack.hand.limits import within_limits
from depthtrack.hand.pose import ANGLES, ORIENTATION, POSITION, make_pose, quaternion_exp, quaternion_product
from depthtrack.hand.postures import POSTURES

Array = NDArray[np.float64]

_HOOKED = np.radians([[0, 20, 40, 60], *([0, 10, 95, 60] for _ in range(4))])
_LOWERED = np.radians([[10, 20, 10, 5], *([0, 70, 15, 10] for _ in range(4))])
_FINGERS = np.stack(
    [*(POSTURES[name].reshape(5, 4) for name in ("open", "relaxed", "grasp", "fist")), _HOOKED, _LOWERED]
)
"""(K, 5, 4) postures of single fingers."""
_PLACE, _TURN, _VARIED = 0.02, 0.3, 0.15
"""Metres, and radians of the whole hand and of each angle, by which what is close by differs: standard deviations."""


def close_by(pose: Array, generator: np.random.Generator, count: int) -> Array:
    """Poses (count, 27) of hands close to where the one in `pose` (27,) is, every finger in some typical posture; in
    every fourth, those of `pose` are kept."""
    shift, turn = generator.standard_normal((2, count, 3)) * [[[_PLACE]], [[_TURN]]]
    mixed = _FINGERS[generator.integers(0, len(_FINGERS), (count, 5)), np.arange(5)].reshape(count, 20)
    kept = (np.arange(count) % 4 == 0)[:, None]
    angles = np.where(kept, pose[ANGLES], mixed) + _VARIED * generator.standard_normal((count, 20))
    quaternions = quaternion_product(quaternion_exp(turn), pose[ORIENTATION])
    return within_limits(make_pose(pose[POSITION] + shift, quaternions, angles))
