"""The hand's place by keypoints of another detector, for frames without a trusted pose.

A start needs the hand without its forearm. The wrist of the lifted pose states where it ends.
"""

from functools import cached_property

import numpy as np

from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.synergies import load_synergies
from depthtrack.recording.sequence import Frame
from depthtrack.solver.lifting import Lifter
from depthtrack.solver.options import LiftOptions
from depthtrack.types import Array

_LARGEST_COST = 0.3
"""Mean robust cost of a lifted pose that guides the segmentation, 0 to 1."""
_LEAST_MEASURED = 0.3
"""Share of the keypoints whose depth agrees with that pose: other parts hide half of a closed hand's."""


class KeypointGuide:
    """Lifts the keypoints of a frame, to guide its segmentation."""

    def __init__(self, model: HandModel) -> None:
        self._model = model

    def pose(self, frame: Frame) -> Array | None:
        """Return the lifted pose (27,); None without keypoints, or if they contradict the depth."""
        if frame.keypoints is None:
            return None
        lifted = self._lifter.lift(frame.keypoints, frame.camera, frame.depth)
        if lifted is None or lifted.cost > _LARGEST_COST:
            return None
        measured = np.isfinite(lifted.points).all(axis=-1)
        return lifted.pose if measured.mean() >= _LEAST_MEASURED else None

    @cached_property
    def _lifter(self) -> Lifter:
        return Lifter(self._model, load_synergies(), LiftOptions())
