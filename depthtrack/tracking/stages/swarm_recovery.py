"""What explains more than a pose that a swarm ended in: other fingers, another place close by. By rendering."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.scorer import Scorer
from depthtrack.tracking.proposals.local import finger_shift_proposals, local_proposals, search_one_finger
from depthtrack.tracking.stages.swarm_search import Polish, SearchOptions, find_candidates
from depthtrack.tracking.state import TrackingThresholds
from depthtrack.types import Array


class RecoveryOptions(NamedTuple):
    """When and how widely to look again at a pose whose energy is above `SearchOptions.good_energy`.

    Every so many-th frame (0: never), and at once where the pose is `doubted`, hands close by, every finger in some
    typical posture, are searched through, from orientations `apart` radians apart. The best is taken if its energy is
    less than the share `accept_local` of what it was, or less at all in doubt; after a loss, one from anywhere else, if
    less than the share `accept_global`. In every frame, one with a single finger elsewhere, or all of them one finger
    further, is taken, if less than the share `accept_finger` (0: never).
    """

    every: int = 5
    apart: float = 0.1
    accept_local: float = 0.93
    accept_global: float = 0.75
    accept_finger: float = 0.98
    doubted: TrackingThresholds = TrackingThresholds(confidence=0.6, energy=12.0)


class Recovery:
    """Looks again at what `scorer` observes."""

    def __init__(self, shape: HandShape, scorer: Scorer, search: SearchOptions, options: RecoveryOptions) -> None:
        self._model, self._scorer, self._options = HandModel(shape), scorer, options
        self._good_energy, self._search = search.good_energy, replace(search, apart=options.apart)

    def search_locally(self, pose: Array, generator: np.random.Generator, polish: Polish | None) -> tuple[Array, float]:
        """The best pose (27,) found close to `pose` (27,), and its energy."""
        poses = local_proposals(pose, generator, self._search.hypotheses)
        poses, energies = find_candidates(self._scorer, poses, generator, self._search, polish)
        return poses[0], float(energies[0])

    def refine_per_finger(
        self, pose: Array, energy: float, generator: np.random.Generator, polish: Polish | None
    ) -> tuple[Array, float]:
        """The pose (27,) and its energy, or one with single fingers elsewhere, where that explains clearly more."""
        if polish is not None:
            beside = np.stack([polish(other) for other in finger_shift_proposals(self._model, pose)])
            energies = self._scorer.score(beside)
            best = int(energies.argmin())
            pose, energy = self._clearly_better(pose, energy, beside[best], float(energies[best]))
        for finger in range(5):
            if energy <= self._good_energy:
                break
            other, lower = search_one_finger(self._scorer, pose, finger, generator)
            pose, energy = self._clearly_better(pose, energy, other, lower)
        return pose, energy

    def _clearly_better(self, pose: Array, energy: float, other: Array, lower: float) -> tuple[Array, float]:
        return (other, lower) if lower < self._options.accept_finger * energy else (pose, energy)
