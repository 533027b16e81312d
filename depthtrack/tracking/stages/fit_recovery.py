"""What explains more than a pose that a descent ended in: other fingers, another place close by. By fitting."""

from typing import NamedTuple

import numpy as np

from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import ANGLES
from depthtrack.hand.shape import HandShape
from depthtrack.hand.synergies import Synergies
from depthtrack.rendering.objective import Objective
from depthtrack.rendering.raster import RasterScorer
from depthtrack.solver.icp import IcpFitter
from depthtrack.solver.prior import Prior
from depthtrack.tracking.proposals.local import finger_shift_proposals, local_proposals, search_one_finger
from depthtrack.tracking.stages.coarse_to_fine import Stage, run_stages, sort_by_energy
from depthtrack.types import Array

_ROUGH = 96
"""Longest side, pixels, at which postures of single fingers are looked at."""


class RecoveryOptions(NamedTuple):
    """When and how widely to look again.

    All of it only where the energy is above `SearchOptions.good_energy`. At every so many-th frame (0: never) and where
    the track would be lost, `hypotheses` are looked at, which go through `stages`. The best is taken if its energy is
    less than the share `accept_local` of what it was; one from anywhere else, less than the share `accept_global`. In
    every frame, one with a single finger elsewhere, or all of them one finger further, is taken, if less than the share
    `accept_finger` (0: never).
    """

    every: int = 5
    hypotheses: int = 3000
    stages: tuple[Stage, ...] = (Stage(48, None, 3), Stage(16, None, 4), Stage(6, None, 8), Stage(2, None, 12))
    accept_local: float = 0.9
    accept_global: float = 0.75
    accept_finger: float = 0.98


class Recovery:
    """Looks again at what `fitter` and `scorer` observe; holds a scorer of fewer pixels."""

    def __init__(
        self,
        shape: HandShape,
        fitter: IcpFitter,
        scorer: RasterScorer,
        synergies: Synergies,
        options: RecoveryOptions,
        objective: Objective,
    ) -> None:
        self._model, self._fitter, self._scorer, self._synergies = HandModel(shape), fitter, scorer, synergies
        self._rough_scorer = RasterScorer(shape, objective)
        self._options = options

    def close(self) -> None:
        """Free the scorer."""
        self._rough_scorer.close()

    def search_locally(self, pose: Array, generator: np.random.Generator) -> tuple[Array, float]:
        """The best pose (27,) found close to `pose` (27,), and its energy."""
        stages = self._options.stages
        poses = sort_by_energy(self._scorer, local_proposals(pose, generator, self._options.hypotheses))[0]
        poses, energies = run_stages(self._fitter, self._scorer, poses[: stages[0].keep], self._synergies, stages)
        return poses[0], float(energies[0])

    def refine_per_finger(self, pose: Array, energy: float, generator: np.random.Generator) -> tuple[Array, float]:
        """The pose (27,) and its energy, or one with single fingers elsewhere, where that explains clearly more: they
        are drawn to what they took for another finger, or bent where nothing pulls them."""
        beside = [self._fitter.fit(other) for other in finger_shift_proposals(self._model, pose)]
        pose, energy = self._clearly_better(pose, energy, beside)
        rough = self._rough_scorer
        rough.set_target(self._scorer.target.reduced(_ROUGH))
        for finger in range(5):
            other, lower = search_one_finger(rough, pose, finger, generator)
            if lower < self._options.accept_finger * rough.score(pose[None])[0]:
                # It has just been found: what nothing pulls is to stay there.
                towards = Prior.towards(other[ANGLES], self._fitter.options.temporal_weight)
                pose, energy = self._clearly_better(pose, energy, [self._fitter.fit(other, prior=towards)])
        return pose, energy

    def _clearly_better(self, pose: Array, energy: float, others: list[Array]) -> tuple[Array, float]:
        poses, energies = sort_by_energy(self._scorer, np.stack(others))
        if energies[0] < self._options.accept_finger * energy:
            return poses[0], float(energies[0])
        return pose, energy
