"""From few synergies to all angles, on one frame alone (Schroeder et al. 2014, Sec. V-B); and its starts.

A single descent depends on where it begins. Postures drawn from the synergies, and orientations where none is given,
are therefore first looked at through the renderer, which tells in microseconds whether one resembles the observation.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from depthtrack.hand.limits import within_limits
from depthtrack.hand.pose import ANGLES, ORIENTATION, make_pose, quaternion_log, quaternion_product
from depthtrack.hand.postures import POSTURES
from depthtrack.hand.synergies import Synergies
from depthtrack.rendering.scorer import Scorer
from depthtrack.tracking.ik.fit import Fitter
from depthtrack.tracking.ik.space import FULL, Space

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Ladder:
    """Stages of the hierarchy: how many synergies each solves for, None for all angles; `rounds` of matches in each.

    Of `samples` postures, the one that looks most like the observation is where the first stage begins; 0 begins at
    the mean posture.
    """

    stages: tuple[int | None, ...] = (4, 8, None)
    rounds: int = 10
    samples: int = 400


@dataclass(frozen=True)
class SearchOptions:
    """How a pose is found from nothing: `hypotheses` drawn at random, of which ever fewer go on.

    The first `starts` to go on differ in orientation by at least `apart` radians, so that likely errors are tried and
    lose; `stages` gives for each stage after that how many go on, in how many synergies (None: all angles), and for
    how many rounds.
    """

    hypotheses: int = 3000
    apart: float = 0.5
    stages: tuple[tuple[int, int | None, int], ...] = ((48, 8, 3), (16, None, 4), (6, None, 8), (2, None, 12))
    good_energy: float = 12.0
    attempts: int = 4


def climb(
    fitter: Fitter, scorer: Scorer, pose: Array, synergies: Synergies, ladder: Ladder, generator: np.random.Generator
) -> Array:
    """The pose (27,) that a hierarchy of stages finds when the global pose of `pose` is about right.

    Nothing is known of the angles: those of `pose` are not looked at.
    """
    start = pose.copy()
    start[ANGLES] = synergies.mean
    if ladder.samples > 0:
        drawn = np.tile(start, (ladder.samples, 1))
        drawn[1:, ANGLES] = postures(synergies, generator, ladder.samples - 1)
        drawn = within_limits(drawn)
        start = drawn[np.argmin(scorer.score(drawn))]
    for count in ladder.stages:
        start = fitter.fit(start, space_of(synergies, count), ladder.rounds)
    return start


def find_pose(
    fitter: Fitter,
    scorer: Scorer,
    centre: Array,
    synergies: Synergies,
    options: SearchOptions,
    generator: np.random.Generator,
) -> tuple[Array, float]:
    """Pose (27,) and energy that best explain the observation, with the palm near `centre` (3,) metres."""
    best: tuple[Array, float] | None = None
    for _ in range(options.attempts):
        found = _search_once(fitter, scorer, centre, synergies, options, generator)
        if best is None or found[1] < best[1]:
            best = found
        if best[1] <= options.good_energy:
            break
    assert best is not None
    return best


def _search_once(
    fitter: Fitter,
    scorer: Scorer,
    centre: Array,
    synergies: Synergies,
    options: SearchOptions,
    generator: np.random.Generator,
) -> tuple[Array, float]:
    poses = _hypotheses(centre, synergies, generator, options.hypotheses)
    energies = scorer.score(poses)
    order = np.argsort(energies, kind="stable")
    poses = poses[order][_apart(poses[order], options.apart, options.stages[0][0])]
    for keep, count, rounds in options.stages:
        space = space_of(synergies, count)
        poses = np.stack([fitter.fit(pose, space, rounds) for pose in poses[:keep]])
        energies = scorer.score(poses)
        order = np.argsort(energies, kind="stable")
        poses, energies = poses[order], energies[order]
    return poses[0], float(energies[0])


def space_of(synergies: Synergies, count: int | None) -> Space:
    """The space of so many synergies, or of as many as there are; None: of all angles."""
    return FULL if count is None else Space.of(synergies, min(count, len(synergies)))


def postures(synergies: Synergies, generator: np.random.Generator, count: int) -> Array:
    """Angles (count, 20) drawn from the normal distribution that the synergies describe."""
    coefficients = generator.standard_normal((count, len(synergies))) * np.sqrt(synergies.variances)
    return synergies.angles(np.clip(coefficients, synergies.lower, synergies.upper))


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
