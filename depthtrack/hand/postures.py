"""Typical postures for searches without a previous pose.

Finger angles (20,), radians, within the joint limits.
"""

import numpy as np

from depthtrack.types import Array

# Degrees, finger by finger: abduction, then three flexions from the palm outward. The flexions of a finger are coupled
# as in natural movement (DIP about two thirds of PIP).
_OPEN = [(0, 0, 0, 0), (12, 0, 0, 0), (2, 0, 0, 0), (-8, 0, 0, 0), (-18, 0, 0, 0)]
_RELAXED = [(5, 5, 10, 15), (6, 20, 25, 12), (0, 25, 28, 14), (-6, 28, 30, 15), (-12, 30, 30, 15)]
_GRASP = [(15, 10, 20, 20), (8, 40, 45, 25), (0, 42, 48, 26), (-6, 45, 48, 26), (-10, 45, 45, 25)]
_FIST = [(12, 22, 45, 45), (4, 75, 95, 55), (0, 78, 95, 55), (-4, 80, 95, 55), (-8, 80, 95, 55)]
_POINT = [_FIST[0], (4, 5, 8, 5), *_FIST[2:]]
_TWO = [_FIST[0], (6, 5, 8, 5), (-6, 5, 8, 5), *_FIST[3:]]
_NAMED = {"open": _OPEN, "relaxed": _RELAXED, "grasp": _GRASP, "fist": _FIST, "point": _POINT, "two": _TWO}

POSTURES: dict[str, Array] = {
    name: np.radians(np.array(fingers, dtype=np.float64).ravel()) for name, fingers in _NAMED.items()
}
