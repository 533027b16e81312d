"""Postures from joint positions: measurement of the hand's sizes, then a fit of every frame."""

from pathlib import Path

import numpy as np

from depthtrack.calibration.keypoint_calibration import shape_from_keypoints, side_of
from depthtrack.errors import InputError
from depthtrack.hand.kinematics import KEYPOINT_NAMES, HandModel
from depthtrack.hand.pose import ANGLES
from depthtrack.hand.shape import Side
from depthtrack.posture_databases.posture_set import PostureSet
from depthtrack.solver.keypoints import fit_poses, is_known
from depthtrack.types import Array

_UNITS = {"metres": 1.0, "centimetres": 0.01, "millimetres": 0.001}
_FINGER = (0.03, 0.16)
"""Length of a finger's three bones, metres: a child's little finger to a large thumb."""


def postures_of_joints(path: Path, keypoints: Array, side: Side | None = None) -> PostureSet:
    """Return the postures of one hand's joints.

    path: named in error messages.
    keypoints: (N, 21, 3) metres, centimetres or millimetres, NaN if unknown.
    side: determined from the joints if None.

    Frames with fewer than three known joints are left out.

    Raises:
        InputError: if the joints are not those of a hand of human size.
    """
    try:
        metres = keypoints * _unit(keypoints)
        shape = shape_from_keypoints(metres, side or side_of(metres), source=str(path))
        fitted = fit_poses(HandModel(shape), metres)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    found = np.isfinite(fitted.residuals)
    return PostureSet(fitted.poses[found][:, ANGLES], float(fitted.residuals[found].mean()))


def _unit(keypoints: Array) -> float:
    """Return the unit, metres, that gives fingers a human length."""
    fingers = keypoints[:, 1:].reshape(-1, 5, 4, 3)
    whole = is_known(fingers).all(axis=-1)
    if not whole.any():
        raise InputError(f"a frame must have all joints of a finger, found none; joints: {', '.join(KEYPOINT_NAMES)}")
    length = float(np.median(np.linalg.norm(np.diff(fingers, axis=2), axis=-1).sum(axis=-1)[whole]))
    for factor in _UNITS.values():
        if _FINGER[0] <= length * factor <= _FINGER[1]:
            return factor
    raise InputError(
        f"joints must be in {', '.join(_UNITS)}, found fingers {length:.3g} long: scale them to the size of a hand"
    )
