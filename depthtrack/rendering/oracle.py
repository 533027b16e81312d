"""Reference scorer: the float64 ray caster and the plain evaluation of Eq. (2)."""

import numpy as np
from numpy.typing import ArrayLike

from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.primitives import Primitives
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.objective import Terms, evaluate
from depthtrack.rendering.options import Objective
from depthtrack.rendering.raycast import raycast
from depthtrack.rendering.scorer import ScorerBase, as_batch
from depthtrack.rendering.target import Target
from depthtrack.types import Array, Depth


class OracleScorer(ScorerBase):
    """Reference backend of the tests, about a thousand times slower than `raster`."""

    name = "oracle"

    def __init__(self, shape: HandShape, objective: Objective | None = None) -> None:
        self._model, self._primitives = HandModel(shape), Primitives.of(shape)
        self._objective = objective or Objective()

    def set_target(self, target: Target) -> None:
        self._target = target

    def score(self, poses: ArrayLike) -> Array:
        return self.terms(poses).energy

    def terms(self, poses: ArrayLike) -> Terms:
        batch = as_batch(poses)
        sums = [self._sums(pose) for pose in batch]
        clamped, matched_silhouette, union = np.array(sums, dtype=np.float64).reshape(-1, 3).T
        return Terms.of_sums(self._objective, batch, clamped, matched_silhouette, union)

    def _sums(self, pose: Array) -> tuple[float, float, float]:
        target = self.target
        drawn = target.before_surroundings(self._depth(pose), self._objective.surroundings_depth)
        before = target.before_occluder(drawn, self._objective.hidden_depth)
        return evaluate(self._objective, target.silhouette, target.depth, drawn, before)

    def render(self, pose: ArrayLike) -> Depth:
        return self._depth(as_batch(np.asarray(pose)[None])[0]).astype(np.float32)

    def _depth(self, pose: Array) -> Array:
        T = self._primitives.transforms(self._model.transforms(pose))
        return raycast(self.target.camera, self._primitives.kinds, T, self._primitives.bodies).depth
