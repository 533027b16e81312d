"""Proposals of a global search.

They have any orientation that the forearm allows, and the palm near the observed centre.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from depthtrack.hand.limits import within_limits
from depthtrack.hand.pose import ORIENTATION, make_pose
from depthtrack.hand.postures import POSTURES
from depthtrack.hand.synergies import Synergies
from depthtrack.segmentation.observation import Observation
from depthtrack.tracking.options import GlobalSearchOptions
from depthtrack.types import Array

DEFAULTS = GlobalSearchOptions()


def global_proposals(
    observation: Observation, synergies: Synergies, generator: np.random.Generator, options: GlobalSearchOptions
) -> Array:
    """Return poses (N, 27) of the observed hand with the postures that the options ask for."""
    angles = mixed_angles(synergies, generator, options)
    arm = observation.arm_direction if options.follow_arm else None
    return orientation_proposals(observation.centre, angles, generator, arm, options)


def orientation_proposals(
    centre: Array,
    angles: Array,
    generator: np.random.Generator,
    arm: Array | None = None,
    options: GlobalSearchOptions = DEFAULTS,
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
        rotations = rotations[np.argsort(towards_wrist @ arm < options.least_along_arm, kind="stable")[:count]]
    quaternions = rotations.as_quat()[:, [3, 0, 1, 2]]
    positions = centre + generator.standard_normal((count, 3)) * options.position_spread
    return within_limits(make_pose(positions, quaternions, angles))


def typical_angles(generator: np.random.Generator, count: int, spread: float = DEFAULTS.angle_spread) -> Array:
    """Return finger angles (count, 20) of typical postures, perturbed by `spread` (rad)."""
    typical = np.stack(list(POSTURES.values()))
    return typical[generator.integers(0, len(typical), count)] + spread * generator.standard_normal((count, 20))


def synergy_angles(synergies: Synergies, generator: np.random.Generator, count: int) -> Array:
    """Return angles (count, 20) drawn from the normal distribution that the synergies describe."""
    coefficients = generator.standard_normal((count, len(synergies))) * np.sqrt(synergies.variances)
    return synergies.angles(np.clip(coefficients, synergies.lower, synergies.upper))


def mixed_angles(synergies: Synergies, generator: np.random.Generator, options: GlobalSearchOptions) -> Array:
    """Return the angles (N, 20), rad, of all proposals.

    A share is drawn from the synergies. The others are typical postures, because some are rare in the recordings behind
    the synergies.
    """
    count, share = options.proposals, options.synergy_share
    if share <= 0:
        return typical_angles(generator, count, options.angle_spread)
    drawn = (np.arange(count) * share % 1 < share)[:, None]
    from_synergies = synergy_angles(synergies, generator, count)
    return np.where(drawn, from_synergies, typical_angles(generator, count, options.angle_spread))


def distinct_orientations(poses: Array, angle: float, count: int) -> list[int]:
    """Return the first `count` rows of poses with orientations apart from those of earlier rows.

    poses: (N, 27).
    angle: least difference, rad.
    """
    quaternions, chosen = poses[:, ORIENTATION], list[int]()
    apart = np.ones(len(poses), np.bool_)
    while len(chosen) < count and apart.any():
        chosen.append(int(apart.argmax()))
        # Rotations differ by twice the arc cosine of the product of their quaternions, in either sign.
        apart &= np.abs(quaternions @ quaternions[chosen[-1]]) <= np.cos(angle / 2)
        apart[chosen[-1]] = False
    return chosen
