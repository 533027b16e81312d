"""A pose from one observation alone: many swarms around the observed hand, the best kept (Oikonomidis 2011, Sec. 3)."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from depthtrack.rendering.scorer import Scorer
from depthtrack.solver.swarm import SwarmOptions, minimise
from depthtrack.solver.swarm_space import TangentSpace
from depthtrack.tracking.proposals.global_ import apart, hypotheses, typical_angles
from depthtrack.types import Array

Polish = Callable[[Array], Array]
"""Moves a pose (27,) to the nearest one that agrees better with the observation, by whatever measure."""


@dataclass(frozen=True)
class Round:
    """One round of a search: the best `starts` go on, each as a swarm with these spreads (m, rad, rad)."""

    starts: int
    swarm: SwarmOptions
    spread: tuple[float, float, float]


def _swarm(particles: int, generations: int) -> SwarmOptions:
    return SwarmOptions(particles, generations, inertia=0.6, near_best=0.5)


@dataclass(frozen=True)
class SearchOptions:
    """How widely to look: `hypotheses` scored at random, then rounds of ever fewer and finer swarms.

    After each round the best `polished` poses are polished, where the search is given a way to. Starts of the first
    round differ in orientation by at least `apart` radians, so that the mirrored pose and other likely errors are tried
    and lose. A search whose energy stays above `good_energy` is repeated, `attempts` in all.
    """

    hypotheses: int = 4000
    apart: float = 0.5
    rounds: tuple[Round, ...] = (
        Round(48, _swarm(32, 12), (0.015, 0.3, 0.3)),
        Round(6, _swarm(64, 20), (0.010, 0.15, 0.2)),
        Round(1, _swarm(64, 40), (0.005, 0.08, 0.1)),
    )
    good_energy: float = 8.0
    attempts: int = 3
    polished: int = 16


def find_pose(
    scorer: Scorer,
    centre: Array,
    generator: np.random.Generator,
    options: SearchOptions,
    polish: Polish | None = None,
    arm: Array | None = None,
) -> tuple[Array, float]:
    """Pose (27,) and energy that best explain what `scorer` observes, with the palm near `centre` (3,) metres.

    `arm` (3,), unit, leads from the palm along the forearm, where that is seen.
    """
    best: tuple[Array, float] | None = None
    for _ in range(options.attempts):
        poses = hypotheses(centre, typical_angles(generator, options.hypotheses), generator, arm)
        poses, energies = find_candidates(scorer, poses, generator, options, polish)
        if best is None or energies[0] < best[1]:
            best = poses[0], float(energies[0])
        if best[1] <= options.good_energy:
            break
    assert best is not None
    return best


def find_candidates(
    scorer: Scorer, poses: Array, generator: np.random.Generator, options: SearchOptions, polish: Polish | None = None
) -> tuple[Array, Array]:
    """What one search ends with that begins with `poses` (N, 27): poses (K, 27) and energies (K,), the best first."""
    poses = poses[np.argsort(scorer.score(poses))]
    starts = poses[apart(poses, options.apart, options.rounds[0].starts)]
    for stage in options.rounds:
        refined = [refine(scorer, pose, stage.spread, stage.swarm, generator) for pose in starts[: stage.starts]]
        poses, energies = np.stack([pose for pose, _ in refined]), np.array([energy for _, energy in refined])
        if polish is not None:
            best = np.argsort(energies, kind="stable")[: options.polished]
            polished = np.stack([polish(pose) for pose in poses[best]])
            poses, energies = np.concatenate([poses, polished]), np.concatenate([energies, scorer.score(polished)])
        order = np.argsort(energies, kind="stable")
        starts, energies = poses[order], energies[order]
    return starts, energies


def refine(
    scorer: Scorer,
    pose: Array,
    spread: tuple[float, float, float],
    options: SwarmOptions,
    generator: np.random.Generator,
) -> tuple[Array, float]:
    """The best pose a swarm finds around `pose` (27,), scattered by `spread`: position, rotation, angles."""
    space = TangentSpace(pose)
    deviation = np.repeat(spread, [3, 3, 20])
    particles = generator.standard_normal((options.particles, 26)) * deviation
    particles[0] = 0
    found = minimise(
        lambda x: scorer.score(space.poses(x)), particles, space.lower, space.upper, space.fingers, generator, options
    )
    return space.poses(found.position[None])[0], found.energy
