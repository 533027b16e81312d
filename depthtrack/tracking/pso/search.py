"""A pose from one observation alone: many swarms around the observed hand, the best kept (Oikonomidis 2011, Sec. 3)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from depthtrack.hand.limits import within_limits
from depthtrack.hand.pose import make_pose, quaternion_log, quaternion_product
from depthtrack.hand.postures import POSTURES
from depthtrack.rendering.scorer import Scorer
from depthtrack.tracking.pso.spaces import TangentSpace
from depthtrack.tracking.pso.swarm import SwarmOptions, minimise

Array = NDArray[np.float64]


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

    Starts of the first round differ in orientation by at least `apart` radians, so that the mirrored pose and other
    likely errors are tried and lose. A search whose energy stays above `good_energy` is repeated, `attempts` in all.
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


def find_pose(
    scorer: Scorer, centre: Array, generator: np.random.Generator, options: SearchOptions
) -> tuple[Array, float]:
    """Pose (27,) and energy that best explain what `scorer` observes, with the palm near `centre` (3,) metres."""
    best: tuple[Array, float] | None = None
    for _ in range(options.attempts):
        poses, energies = find_candidates(scorer, centre, generator, options)
        if best is None or energies[0] < best[1]:
            best = poses[0], float(energies[0])
        if best[1] <= options.good_energy:
            break
    assert best is not None
    return best


def find_candidates(
    scorer: Scorer, centre: Array, generator: np.random.Generator, options: SearchOptions
) -> tuple[Array, Array]:
    """What one search ends with: poses (K, 27) and energies (K,), the best first; one for each start of its last
    round."""
    poses = _hypotheses(centre, generator, options.hypotheses)
    energies = scorer.score(poses)
    poses, energies = poses[np.argsort(energies)], np.sort(energies)
    starts = poses[_apart(poses, options.apart, options.rounds[0].starts)]
    for stage in options.rounds:
        refined = [refine(scorer, pose, stage.spread, stage.swarm, generator) for pose in starts[: stage.starts]]
        refined.sort(key=lambda result: result[1])
        starts = np.stack([pose for pose, _ in refined])
    return starts, np.array([energy for _, energy in refined])


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


def _hypotheses(centre: Array, generator: np.random.Generator, count: int) -> Array:
    """Typical postures, varied, in every orientation, the palm near the observed centre."""
    postures = np.stack(list(POSTURES.values()))
    angles = postures[generator.integers(0, len(postures), count)] + 0.15 * generator.standard_normal((count, 20))
    quaternions = Rotation.random(count, rng=generator).as_quat()[:, [3, 0, 1, 2]]
    positions = centre + generator.standard_normal((count, 3)) * [0.025, 0.025, 0.012]
    return within_limits(make_pose(positions, quaternions, angles))


def _apart(poses: Array, angle: float, count: int) -> list[int]:
    """The first `count` poses, in order, whose orientations differ from those before by at least `angle`."""
    chosen: list[int] = []
    conjugate = poses[:, 3:7] * [1, -1, -1, -1]
    for i in range(len(poses)):
        between = quaternion_log(quaternion_product(poses[i, 3:7], conjugate[chosen]))
        if not len(chosen) or np.linalg.norm(between, axis=-1).min() >= angle:
            chosen.append(i)
        if len(chosen) == count:
            break
    return chosen
