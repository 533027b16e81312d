"""Finds a hand's pose from one frame alone, where nothing but its place is known: starts, and starts again."""

from dataclasses import dataclass

import numpy as np

from depthtrack.hand.synergies import Synergies
from depthtrack.rendering.scorer import Scorer
from depthtrack.solver.icp import IcpFitter
from depthtrack.tracking.proposals.global_ import apart, hypotheses, typical_angles
from depthtrack.tracking.stages.coarse_to_fine import Stage, postures, run_stages, sort_by_energy
from depthtrack.types import Array


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
    fitter: IcpFitter,
    scorer: Scorer,
    centre: Array,
    synergies: Synergies,
    options: SearchOptions,
    generator: np.random.Generator,
    arm: Array | None = None,
) -> tuple[Array, float]:
    """Pose (27,) and energy that best explain the observation, with the palm near `centre` (3,) metres.

    `arm` (3,), unit, leads from the palm along the forearm, where that is seen.
    """
    best, lowest = np.empty(0), np.inf
    for _ in range(options.attempts):
        angles = _angles(synergies, generator, options.hypotheses)
        poses = sort_by_energy(scorer, hypotheses(centre, angles, generator, arm))[0]
        poses = poses[apart(poses, options.apart, options.stages[0].keep)]
        poses, energies = run_stages(fitter, scorer, poses, synergies, options.stages)
        before = lowest
        if energies[0] < lowest:
            best, lowest = poses[0], float(energies[0])
        if lowest <= options.good_energy or lowest > (1 - options.gain) * before:
            break
    return best, lowest


def _angles(synergies: Synergies, generator: np.random.Generator, count: int) -> Array:
    """Finger angles (count, 20): half of them after the synergies, half after typical postures, some of which may be
    rare in recordings."""
    half = np.arange(count)[:, None] % 2 == 0
    return np.where(half, postures(synergies, generator, count), typical_angles(generator, count))
