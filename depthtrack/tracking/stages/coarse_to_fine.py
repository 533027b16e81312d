"""From few synergies to all angles, on one frame alone (Schroeder et al. 2014, Sec. V-B); and its starts.

A single descent depends on where it begins. Several postures therefore go on from stage to stage, fewer each time;
the renderer tells in microseconds which of them resemble the observation.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from depthtrack.hand.limits import within_limits
from depthtrack.hand.pose import ANGLES
from depthtrack.hand.shape import HandShape
from depthtrack.hand.synergies import Synergies
from depthtrack.rendering.raster import RasterScorer
from depthtrack.rendering.scorer import Scorer
from depthtrack.segmentation.observation import Observation
from depthtrack.solver.icp import IcpFitter, IcpOptions
from depthtrack.solver.prior import Prior
from depthtrack.solver.subspace import FULL, PostureSubspace
from depthtrack.tracking.random import frame_generator
from depthtrack.tracking.surfaces.registry import Model, make_surface
from depthtrack.types import Array

_LONGEST_SIDE = 128
"""Pixels of the longest side at which poses are rendered to compare them."""


class Stage(NamedTuple):
    """A stage takes up the best `keep` poses and fits each of them in so many `synergies`, None for all angles, for
    `rounds` of matches; while `coarse`, to a quarter of the points."""

    keep: int
    synergies: int | None
    rounds: int
    coarse: bool = False


@dataclass(frozen=True)
class CoarseToFine:
    """The hierarchy: `stages`, and the `samples` postures from which the first of them takes the best that differ by
    `apart` (rad, root mean square) or more. One sample is the mean posture."""

    stages: tuple[Stage, ...] = (
        Stage(24, 8, 4, True),
        Stage(8, 12, 4, True),
        Stage(4, None, 6, True),
        Stage(2, None, 8),
    )
    samples: int = 400
    apart: float = 0.15


PAPER_COARSE_TO_FINE = CoarseToFine((Stage(1, 1, 10), Stage(1, 4, 10), Stage(1, None, 10)), samples=1)
"""Schroeder et al. 2014, Fig. 11: 1 synergy, 4, all angles, from the mean posture, ten ICP iterations each."""

DIRECT = CoarseToFine((Stage(1, None, 10),), samples=1)
"""No hierarchy: all angles at once, from the mean posture."""


class SingleFrameFitter:
    """Estimates a hand's posture from one frame alone, where only its global pose is known.

    `fit` says how, `PAPER_ICP` as the paper does; every `subsample`-th point is used. Equal calls give equal bits.
    """

    def __init__(
        self,
        shape: HandShape,
        synergies: Synergies,
        coarse_to_fine: CoarseToFine | None = None,
        fit: IcpOptions | None = None,
        model: Model = "skin",
        subsample: int = 1,
        seed: int = 0,
    ) -> None:
        options = fit or IcpOptions()
        self._fitter = IcpFitter(shape, make_surface(model, shape), options)
        self._scorer = RasterScorer(shape)
        self._synergies, self._ladder = synergies, coarse_to_fine or CoarseToFine()
        self._subsample, self._seed = subsample, seed

    def estimate(self, observation: Observation, pose: ArrayLike) -> Array:
        """The pose (27,) of the observed hand: `pose` (27,) tells about where it is; its angles are not looked at."""
        self._scorer.set_target(observation.reduced(_LONGEST_SIDE))
        self._fitter.set_target(observation, self._subsample)
        generator = frame_generator(self._seed, observation.frame_index)
        start = np.array(pose, dtype=np.float64)
        return estimate_single_frame(self._fitter, self._scorer, start, self._synergies, self._ladder, generator)


def estimate_single_frame(
    fitter: IcpFitter,
    scorer: Scorer,
    pose: Array,
    synergies: Synergies,
    coarse_to_fine: CoarseToFine,
    generator: np.random.Generator,
) -> Array:
    """The pose (27,) that a hierarchy of stages finds when the global part of `pose` is about right."""
    poses = np.tile(pose, (coarse_to_fine.samples, 1))
    poses[0, ANGLES] = synergies.mean
    poses[1:, ANGLES] = postures(synergies, generator, coarse_to_fine.samples - 1)
    poses = sort_by_energy(scorer, within_limits(poses))[0]
    poses = poses[_different(poses[:, ANGLES], coarse_to_fine.apart, coarse_to_fine.stages[0].keep)]
    return run_stages(fitter, scorer, poses, synergies, coarse_to_fine.stages)[0][0]


def run_stages(
    fitter: IcpFitter, scorer: Scorer, poses: Array, synergies: Synergies, stages: Sequence[Stage]
) -> tuple[Array, Array]:
    """Poses (N, 27), best first, and their energies (N,) after all stages; `poses` (B, 27) are best first too.

    A stage of all angles keeps those that the observation says nothing of near where the synergies led.
    """
    energies = np.full(len(poses), np.inf)
    for keep, count, rounds, coarse in stages:
        poses = np.stack([_fit(fitter, pose, space_of(synergies, count), rounds, coarse) for pose in poses[:keep]])
        poses, energies = sort_by_energy(scorer, poses)
    return poses, energies


def _fit(fitter: IcpFitter, pose: Array, space: PostureSubspace, rounds: int, coarse: bool) -> Array:
    prior = Prior.towards(pose[ANGLES], fitter.options.temporal_weight) if space.full else None
    return fitter.fit(pose, space, rounds, prior, coarse)


def sort_by_energy(scorer: Scorer, poses: Array) -> tuple[Array, Array]:
    """Poses (N, 27) sorted by how well they explain the observation, best first, and their energies (N,)."""
    energies = scorer.score(poses)
    order = np.argsort(energies, kind="stable")
    return poses[order], energies[order]


def space_of(synergies: Synergies, count: int | None) -> PostureSubspace:
    """The space of so many synergies, or of as many as there are; None: of all angles."""
    return FULL if count is None else PostureSubspace.of(synergies, min(count, len(synergies)))


def postures(synergies: Synergies, generator: np.random.Generator, count: int) -> Array:
    """Angles (count, 20) drawn from the normal distribution that the synergies describe."""
    coefficients = generator.standard_normal((count, len(synergies))) * np.sqrt(synergies.variances)
    return synergies.angles(np.clip(coefficients, synergies.lower, synergies.upper))


def _different(angles: Array, apart: float, count: int) -> list[int]:
    """The first `count` of angles (N, 20), in order, that differ from those before by `apart`, root mean square."""
    chosen: list[int] = []
    for i, one in enumerate(angles):
        if not chosen or np.sqrt(np.mean((angles[chosen] - one) ** 2, axis=1)).min() >= apart:
            chosen.append(i)
        if len(chosen) == count:
            break
    return chosen
