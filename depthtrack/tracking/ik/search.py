"""Finds a hand's pose from one frame alone, where nothing but its place is known: starts, and starts again."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from depthtrack.hand.limits import within_limits
from depthtrack.hand.pose import ORIENTATION, make_pose, quaternion_log, quaternion_product
from depthtrack.hand.postures import POSTURES
from depthtrack.hand.synergies import Synergies
from depthtrack.rendering.scorer import Scorer
from depthtrack.tracking.ik.fit import Fitter
from depthtrack.tracking.ik.hierarchy import Stage, by_energy, descend, postures

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SearchOptions:
    """How a pose is found from nothing: `hypotheses` drawn at random go through `stages` of ever fewer.

    Those that the first stage takes up differ in orientation by at least `apart` radians, so that likely errors are
    tried and lose. An energy of `good_energy` ends the search; else it is repeated, up to `attempts` times in all,
    until that gains less than the share `gain`: a hand of other sizes than the model's has no good pose.
    """

    hypotheses: int = 3000
    apart: float = 0.5
    stages: tuple[Stage, ...] = (Stage(48, 8, 3), Stage(16, None, 4), Stage(6, None, 8), Stage(2, None, 12))
    good_energy: float = 12.0
    attempts: int = 4
    gain: float = 0.1


def find_pose(
    fitter: Fitter,
    scorer: Scorer,
    centre: Array,
    synergies: Synergies,
    options: SearchOptions,
    generator: np.random.Generator,
) -> tuple[Array, float]:
    """Pose (27,) and energy that best explain the observation, with the palm near `centre` (3,) metres."""
    best, lowest = np.empty(0), np.inf
    for _ in range(options.attempts):
        poses = by_energy(scorer, _hypotheses(centre, synergies, generator, options.hypotheses))[0]
        poses = poses[_apart(poses, options.apart, options.stages[0].keep)]
        poses, energies = descend(fitter, scorer, poses, synergies, options.stages)
        before = lowest
        if energies[0] < lowest:
            best, lowest = poses[0], float(energies[0])
        if lowest <= options.good_energy or lowest > (1 - options.gain) * before:
            break
    return best, lowest


def _hypotheses(centre: Array, synergies: Synergies, generator: np.random.Generator, count: int) -> Array:
    """Postures in every orientation, the palm near the observed centre: half of them after the synergies, half after
    typical postures, some of which may be rare in recordings."""
    quaternions = Rotation.random(count, rng=generator).as_quat()[:, [3, 0, 1, 2]]
    positions = centre + generator.standard_normal((count, 3)) * [0.025, 0.025, 0.012]
    typical = np.stack(list(POSTURES.values()))[generator.integers(0, len(POSTURES), count)]
    typical = typical + 0.15 * generator.standard_normal((count, 20))
    half = np.arange(count)[:, None] % 2 == 0
    angles = np.where(half, postures(synergies, generator, count), typical)
    return within_limits(make_pose(positions, quaternions, angles))


def _apart(poses: Array, angle: float, count: int) -> list[int]:
    """The first `count` poses, in order, whose orientations differ from those before by at least `angle`."""
    chosen: list[int] = []
    conjugate = poses[:, ORIENTATION] * [1, -1, -1, -1]
    for i in range(len(poses)):
        between = quaternion_log(quaternion_product(poses[i, ORIENTATION], conjugate[chosen]))
        if not chosen or np.linalg.norm(between, axis=-1).min() >= angle:
            chosen.append(i)
        if len(chosen) == count:
            break
    return chosen
