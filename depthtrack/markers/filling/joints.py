"""Parameters that visible markers determine (Maycock et al. 2015, Sec. III-C)."""

import numpy as np

from depthtrack.hand.compiled_kinematics import BODY_COUNT
from depthtrack.hand.kinematics import MOVES
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.types import Mask

POSE_MARKERS = 3
"""Points that determine a rigid motion."""


def determined(model: MarkerModel, visible: Mask) -> Mask:
    """Return whether visible markers determine each parameter (..., 26) of the tangent space.

    visible: (..., M).

    A joint is determined by a marker that it moves: one on its own phalanx, or farther out on the finger, which
    "can drive the entire chain". Three markers of the model determine the palm.
    """
    visible = np.asarray(visible, dtype=np.bool_)
    moves = np.zeros((BODY_COUNT, 26), dtype=np.bool_)
    moves[:, 6:] = MOVES
    found = np.asarray((visible[..., :, None] & moves[model.bodies]).any(axis=-2))
    found[..., :6] = (visible.sum(axis=-1) >= POSE_MARKERS)[..., None]
    return found


def affecting(model: MarkerModel, marker: int) -> Mask:
    """Return which parameters (26,) move a marker."""
    return np.concatenate([np.ones(6, dtype=np.bool_), MOVES[model.bodies[marker]]])
