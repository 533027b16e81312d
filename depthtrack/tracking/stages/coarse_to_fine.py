"""From few synergies to all angles, on one frame alone (Schroeder et al. 2014, Sec. V-B).

A single descent depends on its start. Several postures therefore continue from round to round, fewer each time; their
rendered energy decides which.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from depthtrack.hand.limits import within_limits
from depthtrack.hand.pose import ANGLES
from depthtrack.hand.synergies import Synergies
from depthtrack.rendering.scorer import Scorer
from depthtrack.segmentation.observation import Observation
from depthtrack.solver.icp import IcpFitter
from depthtrack.solver.options import SurfaceFitOptions
from depthtrack.solver.parallel_fits import ParallelFits
from depthtrack.solver.subspace import FULL, PostureSubspace
from depthtrack.tracking.candidate import Candidate, by_energy, evaluate, poses_of
from depthtrack.tracking.frame import Toolkit
from depthtrack.tracking.options import FitRound
from depthtrack.tracking.posture_prior import prior_near
from depthtrack.tracking.proposals.global_ import synergy_angles
from depthtrack.tracking.random import frame_generator
from depthtrack.tracking.timing import Deadline
from depthtrack.types import Array


@dataclass(frozen=True)
class CoarseToFine:
    """Rounds of the coarse-to-fine fit for the posture of a single frame.

    samples: postures from which the first round takes the best; one sample is the mean posture.
    min_difference: least root mean square difference (rad) between the postures that continue.
    resolution: longest side, pixels, at which poses are rendered to compare them.
    """

    rounds: tuple[FitRound, ...] = (
        FitRound(24, 8, 4, True),
        FitRound(8, 12, 4, True),
        FitRound(4, None, 6, True),
        FitRound(2, None, 8),
    )
    samples: int = 400
    min_difference: float = 0.15
    resolution: int = 128


PAPER_COARSE_TO_FINE = CoarseToFine((FitRound(1, 1, 10), FitRound(1, 4, 10), FitRound(1, None, 10)), samples=1)
"""Schroeder et al. 2014, Fig. 11: 1 synergy, 4, all angles, from the mean posture, ten ICP iterations each."""

DIRECT = CoarseToFine((FitRound(1, None, 10),), samples=1)
"""No hierarchy: all angles at once, from the mean posture."""


def estimate_single_frame(
    tools: Toolkit,
    observation: Observation,
    pose: ArrayLike,
    coarse_to_fine: CoarseToFine,
    fit: SurfaceFitOptions,
    seed: int = 0,
) -> Candidate:
    """Return the posture of the observed hand if only its global pose is known.

    pose: (27,) approximate global pose; its angles are ignored.
    """
    tools.set_target(observation)
    scorer, fitter = tools.scorer_at(coarse_to_fine.resolution, observation), tools.fitter(fit, observation)
    generator = frame_generator(seed, observation.frame_index)
    poses = np.tile(np.asarray(pose, dtype=np.float64), (coarse_to_fine.samples, 1))
    poses[0, ANGLES] = tools.synergies.mean
    poses[1:, ANGLES] = synergy_angles(tools.synergies, generator, coarse_to_fine.samples - 1)
    starts = evaluate(scorer, within_limits(poses))
    distinct = _distinct_postures(
        poses_of(starts)[:, ANGLES], coarse_to_fine.min_difference, coarse_to_fine.rounds[0].keep
    )
    chosen = [starts[i] for i in distinct]
    return run_rounds(fitter, tools.fits, scorer, chosen, tools.synergies, coarse_to_fine.rounds, kept=1.0)[0]


def run_rounds(
    fitter: IcpFitter,
    fits: ParallelFits,
    scorer: Scorer,
    starts: list[Candidate],
    synergies: Synergies,
    rounds: Sequence[FitRound],
    kept: float,
    deadline: Deadline | None = None,
    goes_on: Callable[[Candidate], bool] | None = None,
) -> list[Candidate]:
    """Return candidates, best first, after all rounds from `starts`, best first.

    kept: share of a posture's distance from the mean one that the prior of a round keeps.
    deadline: time at which the rounds end; candidates that were not fitted by then stay as they are.
    goes_on: whether a fitted candidate is worth another round; the others are left out. None for all.

    A round of all angles holds the angles that the observation does not constrain near where the synergies led.
    """
    deadline = deadline or Deadline()
    for each in rounds:
        chosen = starts[: each.keep]
        fit = partial(fit_in_synergies, synergies=synergies, options=each, kept=kept)
        poses = fits.fit_each(fitter, [start.pose for start in chosen], fit, lambda: deadline.is_over)
        if not poses:
            break
        starts = by_energy([*evaluate(scorer, np.stack(poses)), *chosen[len(poses) :]])
        starts = starts if goes_on is None else list(filter(goes_on, starts))
    return starts


def fit_in_synergies(fitter: IcpFitter, pose: Array, synergies: Synergies, options: FitRound, kept: float) -> Array:
    """Return `pose` (27,) fitted in the synergies, or in all angles, of one round."""
    subspace = posture_subspace(synergies, options.synergies)
    prior = prior_near(pose[ANGLES], kept, fitter.options) if subspace.full else None
    return fitter.fit(pose, subspace, options.icp_iterations, prior, options.coarse)


def posture_subspace(synergies: Synergies, count: int | None) -> PostureSubspace:
    """Return the subspace of the first `count` synergies, at most all; None for all angles."""
    return FULL if count is None else PostureSubspace.of(synergies, min(count, len(synergies)))


def _distinct_postures(angles: Array, difference: float, count: int) -> list[int]:
    """Return the first `count` rows of angles that differ from earlier rows.

    angles: (N, 20) rad.
    difference: least RMS difference, rad.
    """
    chosen: list[int] = []
    for i, one in enumerate(angles):
        if not chosen or np.sqrt(np.mean((angles[chosen] - one) ** 2, axis=1)).min() >= difference:
            chosen.append(i)
        if len(chosen) == count:
            break
    return chosen
