"""Proposals of a global search: any orientation that the forearm allows, the palm near the observed centre."""

import numpy as np
from scipy.spatial.transform import Rotation

from depthtrack.geometry.rotations import quaternion_log, quaternion_product
from depthtrack.hand.limits import within_limits
from depthtrack.hand.pose import ORIENTATION, make_pose
from depthtrack.hand.postures import POSTURES
from depthtrack.hand.synergies import Synergies
from depthtrack.types import Array

POSITION_SPREAD = (0.025, 0.025, 0.012)
"""Standard deviation of the palm about the observed centre along the camera's axes, metres."""
ANGLE_SPREAD = 0.15
"""Standard deviation of angles about those of typical postures, radians."""
LEAST_ALONG_ARM = 0.17
"""Cosine of the 80 degrees that a wrist bends at most (Greene and Heckman 1994), either way."""


def orientation_proposals(
    centre: Array, angles: Array, generator: np.random.Generator, arm: Array | None = None
) -> Array:
    """Return poses (N, 27) with random orientations; those that the forearm allows come first.

    centre: (3,) observed centre of the palm, m, camera frame.
    angles: (N, 20) finger angles, rad.
    arm: (3,) unit direction from the palm along the forearm, or None.
    """
    count = len(angles)
    # An arm excludes half of all orientations: four times as many leave enough of the others.
    rotations = Rotation.random(count if arm is None else 4 * count, rng=generator)
    if arm is not None:
        towards_wrist = rotations.apply([0.0, -1.0, 0.0])
        rotations = rotations[np.argsort(towards_wrist @ arm < LEAST_ALONG_ARM, kind="stable")[:count]]
    quaternions = rotations.as_quat()[:, [3, 0, 1, 2]]
    positions = centre + generator.standard_normal((count, 3)) * POSITION_SPREAD
    return within_limits(make_pose(positions, quaternions, angles))


def typical_angles(generator: np.random.Generator, count: int) -> Array:
    """Return finger angles (count, 20) of typical postures, perturbed."""
    typical = np.stack(list(POSTURES.values()))
    return typical[generator.integers(0, len(typical), count)] + ANGLE_SPREAD * generator.standard_normal((count, 20))


def synergy_angles(synergies: Synergies, generator: np.random.Generator, count: int) -> Array:
    """Return angles (count, 20) drawn from the normal distribution that the synergies describe."""
    coefficients = generator.standard_normal((count, len(synergies))) * np.sqrt(synergies.variances)
    return synergies.angles(np.clip(coefficients, synergies.lower, synergies.upper))


def mixed_angles(synergies: Synergies, share: float, generator: np.random.Generator, count: int) -> Array:
    """Return angles (count, 20), this share of them drawn from the synergies, the others typical postures.

    Typical postures matter because some are rare in the recordings that synergies are computed from.
    """
    if share <= 0:
        return typical_angles(generator, count)
    drawn = (np.arange(count) * share % 1 < share)[:, None]
    return np.where(drawn, synergy_angles(synergies, generator, count), typical_angles(generator, count))


def distinct_orientations(poses: Array, angle: float, count: int) -> list[int]:
    """Return the first `count` rows of poses (N, 27) whose orientations differ from earlier ones by `angle` (rad)."""
    chosen: list[int] = []
    conjugate = poses[:, ORIENTATION] * [1, -1, -1, -1]
    for i in range(len(poses)):
        between = quaternion_log(quaternion_product(poses[i, ORIENTATION], conjugate[chosen]))
        if not chosen or np.linalg.norm(between, axis=-1).min() >= angle:
            chosen.append(i)
        if len(chosen) == count:
            break
    return chosen
