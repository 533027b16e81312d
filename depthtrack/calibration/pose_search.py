"""Poses of a hand of given sizes in the views of a rig's calibration."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from depthtrack.calibration.acceptance import check_resembles_hand
from depthtrack.calibration.options import RigCalibrationOptions
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.scorer import Scorer
from depthtrack.segmentation.observation import Observation
from depthtrack.tracking.candidate import Candidate, by_energy, evaluate, poses_of
from depthtrack.tracking.options import GlobalSearchOptions, SwarmSearchOptions
from depthtrack.tracking.proposals.global_ import orientation_proposals, typical_angles
from depthtrack.tracking.random import frame_generator
from depthtrack.tracking.stages.searches import swarm_search
from depthtrack.types import Array, Index

_SEARCH = SwarmSearchOptions(refine=False)
_PROPOSALS = GlobalSearchOptions()

ScorerFactory = Callable[[HandShape], Scorer]
"""Makes the scorer of a hand; calibration closes it. The energies of its backend decide which poses are kept."""
Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Found:
    """Poses of a hand in the views.

    `poses` (V, 27), camera frame; `energies` (V,); `agreements` (V,): of the silhouettes, 0 to 1.
    """

    poses: Array
    energies: Array
    agreements: Array

    def best(self, share: float) -> Index:
        """Return the indices of the views with the lowest energies, at least two."""
        return np.argsort(self.energies, kind="stable")[: max(2, round(share * len(self.energies)))]

    def check_hand(self, least: float) -> None:
        """Check that the median agreement of the silhouettes is at least `least`.

        Raises:
            InputError: if it is lower.
        """
        check_resembles_hand(self.agreements.tolist(), least)


class PoseSearcher:
    """Search for the pose of a hand in each view, without an initial pose."""

    def __init__(
        self, observations: list[Observation], scorer: ScorerFactory, seed: int, options: RigCalibrationOptions
    ) -> None:
        self.observations, self.options = observations, options
        self._scorer, self._seed = scorer, seed

    def find(self, shape: HandShape, count: int | None = None, attempts: int = 1) -> Found:
        """Search in the first `count` views, or in all."""
        best: list[Candidate] = []
        with self._scorer(shape) as scorer:
            for o in self.observations[:count]:
                scorer.set_target(o.reduced(self.options.resolution))
                generator = frame_generator(self._seed, o.frame_index)
                best.append(by_energy(_search_once(scorer, o, generator) for _ in range(attempts))[0])
        energies, agreements = ([getattr(one, name) for one in best] for name in ("energy", "agreement"))
        return Found(poses_of(best), np.array(energies), np.array(agreements))


def _search_once(scorer: Scorer, o: Observation, generator: np.random.Generator) -> Candidate:
    """Return the best candidate of one global search of an observation."""
    angles = typical_angles(generator, _PROPOSALS.proposals)
    starts = evaluate(scorer, orientation_proposals(o.centre, angles, generator, o.arm_direction))
    return swarm_search(scorer, starts, generator, _SEARCH, _PROPOSALS.min_angle)[0]
