"""Poses to begin a search with: any orientation that the forearm allows, about where the hand is seen."""

import numpy as np
from scipy.spatial.transform import Rotation

from depthtrack.geometry.rotations import quaternion_log, quaternion_product
from depthtrack.hand.limits import within_limits
from depthtrack.hand.pose import ORIENTATION, make_pose
from depthtrack.hand.postures import POSTURES
from depthtrack.types import Array

_PLACE = (0.025, 0.025, 0.012)
"""Metres: how far the palm may be from the observed centre, standard deviations along the camera's axes."""
_VARIED = 0.15
"""Radians by which angles differ from typical ones: standard deviation."""
_LEAST_ALONG_ARM = 0.17
"""Cosine of the 80 degrees that a wrist bends at most (Greene and Heckman 1994), either way."""


def hypotheses(centre: Array, angles: Array, generator: np.random.Generator, arm: Array | None = None) -> Array:
    """Poses (N, 27) with these finger angles (N, 20) in every orientation, the palm near the observed `centre` (3,).

    Of the orientations, those come first that a wrist at the end of `arm` (3,) allows: unit, from the palm along the
    forearm.
    """
    count = len(angles)
    # An arm forbids half of all orientations: there are enough of the others among so many.
    rotations = Rotation.random(count if arm is None else 4 * count, rng=generator)
    if arm is not None:
        towards_wrist = rotations.apply([0.0, -1.0, 0.0])
        rotations = rotations[np.argsort(towards_wrist @ arm < _LEAST_ALONG_ARM, kind="stable")[:count]]
    quaternions = rotations.as_quat()[:, [3, 0, 1, 2]]
    positions = centre + generator.standard_normal((count, 3)) * _PLACE
    return within_limits(make_pose(positions, quaternions, angles))


def typical_angles(generator: np.random.Generator, count: int) -> Array:
    """Finger angles (count, 20) of typical postures, each varied a little."""
    typical = np.stack(list(POSTURES.values()))
    return typical[generator.integers(0, len(typical), count)] + _VARIED * generator.standard_normal((count, 20))


def apart(poses: Array, angle: float, count: int) -> list[int]:
    """The first `count` of poses (N, 27), in order, whose orientations differ from those before by at least `angle`."""
    chosen: list[int] = []
    conjugate = poses[:, ORIENTATION] * [1, -1, -1, -1]
    for i in range(len(poses)):
        between = quaternion_log(quaternion_product(poses[i, ORIENTATION], conjugate[chosen]))
        if not chosen or np.linalg.norm(between, axis=-1).min() >= angle:
            chosen.append(i)
        if len(chosen) == count:
            break
    return chosen
