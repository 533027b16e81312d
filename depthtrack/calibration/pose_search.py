"""Poses of a hand of given sizes in the views of a calibration."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from depthtrack.calibration.options import CalibrationOptions
from depthtrack.calibration.residuals import CalibrationView
from depthtrack.errors import InputError
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
        if np.median(self.agreements) < least:
            raise InputError(
                f"the object found in {len(self.poses)} frames does not resemble a hand (silhouettes agree to "
                f"{np.median(self.agreements):.0%}): calibrate on a recording of one bare hand, best with open fingers"
            )


class PoseSearcher:
    """Search for the pose of a hand in each view, without an initial pose."""

    def __init__(
        self, observations: list[Observation], scorer: ScorerFactory, seed: int, options: CalibrationOptions
    ) -> None:
        self.observations, self.options = observations, options
        self._scorer, self._seed = scorer, seed
        self.views = [CalibrationView(o) for o in observations]

    def find(self, shape: HandShape, count: int | None = None, attempts: int = 1) -> Found:
        """Search in the first `count` views, or in all."""
        return self._search(shape, self.observations[:count], attempts, None)

    def improve(self, shape: HandShape, poses: Array, attempts: int = 2) -> Found:
        """Search in all views; return earlier `poses` (V, 27) where they have a lower energy."""
        return self._search(shape, self.observations, attempts, poses)

    def candidates(self, shape: HandShape, count: int) -> list[tuple[Array, Array]]:
        """Return likely poses (K, 27) and their energies (K,) in each of the first `count` views."""
        wide = replace(_SEARCH, rounds=_SEARCH.rounds[:2])
        out = []
        with self._scorer(shape) as scorer:
            for o in self.observations[:count]:
                scorer.set_target(o.reduced(self.options.resolution))
                generator = frame_generator(self._seed, o.frame_index)
                found = _search_once(scorer, o, generator, wide)
                out.append((poses_of(found), np.array([candidate.energy for candidate in found])))
        return out

    def energy(self, shape: HandShape, view: int, pose: Array) -> float:
        """Return the energy of a hand in a pose (27,), in one view."""
        with self._scorer(shape) as scorer:
            scorer.set_target(self.observations[view].reduced(self.options.resolution))
            return float(scorer.score(pose[None])[0])

    def _search(self, shape: HandShape, observations: list[Observation], attempts: int, known: Array | None) -> Found:
        best: list[Candidate] = []
        with self._scorer(shape) as scorer:
            for n, o in enumerate(observations):
                scorer.set_target(o.reduced(self.options.resolution))
                generator = frame_generator(self._seed, o.frame_index)
                tried = [_search_once(scorer, o, generator, _SEARCH)[0] for _ in range(attempts)]
                tried += [] if known is None else evaluate(scorer, known[n][None])
                best.append(by_energy(tried)[0])
        energies, agreements = ([getattr(one, name) for one in best] for name in ("energy", "agreement"))
        return Found(poses_of(best), np.array(energies), np.array(agreements))


def _search_once(
    scorer: Scorer, o: Observation, generator: np.random.Generator, options: SwarmSearchOptions
) -> list[Candidate]:
    """Return candidates of one global search of an observation, best first."""
    angles = typical_angles(generator, _PROPOSALS.proposals)
    starts = evaluate(scorer, orientation_proposals(o.centre, angles, generator, o.arm_direction))
    return swarm_search(scorer, starts, generator, options, _PROPOSALS.min_angle)
