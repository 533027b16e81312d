"""What explains more than a pose that a descent ended in: other fingers, another place close by. By fitting."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import ANGLES
from depthtrack.hand.shape import HandShape
from depthtrack.hand.synergies import Synergies
from depthtrack.rendering.objective import Objective
from depthtrack.rendering.raster import RasterScorer
from depthtrack.solver.icp import Fitter
from depthtrack.solver.prior import Prior
from depthtrack.tracking.proposals.local import close_by, one_finger_further, other_finger
from depthtrack.tracking.stages.coarse_to_fine import Stage, by_energy, descend

Array = NDArray[np.float64]

_ROUGH = 96
"""Longest side, pixels, at which postures of single fingers are looked at."""


class LookAgain(NamedTuple):
    """When and how widely to look again.

    All of it only where the energy is above `SearchOptions.good_energy`. At every so many-th frame (0: never) and where
    the track would be lost, `hypotheses` are looked at, which go through `stages`. The best is taken if its energy is
    less than the share `close_by` of what it was; one from anywhere else, less than the share `elsewhere`. In every
    frame, one with a single finger elsewhere, or all of them one finger further, is taken, if less than the share
    `one_finger` (0: never).
    """

    every: int = 5
    hypotheses: int = 3000
    stages: tuple[Stage, ...] = (Stage(48, None, 3), Stage(16, None, 4), Stage(6, None, 8), Stage(2, None, 12))
    close_by: float = 0.9
    elsewhere: float = 0.75
    one_finger: float = 0.98


class SecondThoughts:
    """Looks again at what `fitter` and `scorer` observe; holds a scorer of fewer pixels."""

    def __init__(
        self,
        shape: HandShape,
        fitter: Fitter,
        scorer: RasterScorer,
        synergies: Synergies,
        options: LookAgain,
        objective: Objective,
    ) -> None:
        self._model, self._fitter, self._scorer, self._synergies = HandModel(shape), fitter, scorer, synergies
        self._rough_scorer = RasterScorer(shape, objective)
        self._options = options

    def close(self) -> None:
        """Free the scorer."""
        self._rough_scorer.close()

    def close_by(self, pose: Array, generator: np.random.Generator) -> tuple[Array, float]:
        """The best pose (27,) found close to `pose` (27,), and its energy."""
        stages = self._options.stages
        poses = by_energy(self._scorer, close_by(pose, generator, self._options.hypotheses))[0]
        poses, energies = descend(self._fitter, self._scorer, poses[: stages[0].keep], self._synergies, stages)
        return poses[0], float(energies[0])

    def finger_by_finger(self, pose: Array, energy: float, generator: np.random.Generator) -> tuple[Array, float]:
        """The pose (27,) and its energy, or one with single fingers elsewhere, where that explains clearly more: they
        are drawn to what they took for another finger, or bent where nothing pulls them."""
        beside = [self._fitter.fit(other) for other in one_finger_further(self._model, pose)]
        pose, energy = self._clearly_better(pose, energy, beside)
        rough = self._rough_scorer
        rough.observe(self._scorer.target.reduced(_ROUGH))
        for finger in range(5):
            other, lower = other_finger(rough, pose, finger, generator)
            if lower < self._options.one_finger * rough.score(pose[None])[0]:
                # It has just been found: what nothing pulls is to stay there.
                held = Prior.held(other[ANGLES], self._fitter.options.hold)
                pose, energy = self._clearly_better(pose, energy, [self._fitter.fit(other, prior=held)])
        return pose, energy

    def _clearly_better(self, pose: Array, energy: float, others: list[Array]) -> tuple[Array, float]:
        poses, energies = by_energy(self._scorer, np.stack(others))
        if energies[0] < self._options.one_finger * energy:
            return poses[0], float(energies[0])
        return pose, energy
