"""Export to the parameters of MANO: rotations of 16 joints as axis times angle, npz or JSON.

Rotations turn our hand from the posture of MANO's template (`flat_hand_mean=True`, zero pose). So they give MANO's
bones the directions of ours. Our joints in that posture are written too, since their distances are those of our hand.

Source: Romero, Tzionas and Black, "Embodied hands", ACM Trans. Graphics 36(6), 2017; the order of the joints and the
axes are those of the published model.
"""

from pathlib import Path
from typing import Any

import numpy as np

from depthtrack.export.joint_track import JointTrack
from depthtrack.files import replace_atomically, write_atomic
from depthtrack.geometry.rotations import quaternion_from_matrix, quaternion_log
from depthtrack.hand.kinematics import JOINT_NAMES, HandModel
from depthtrack.hand.rest_rotations import JOINT_PARENTS, RestSkeleton
from depthtrack.strict_data import exact_json_text
from depthtrack.types import Array

_FINGERS = ("index", "middle", "little", "ring", "thumb")
_OURS = (0, *(JOINT_NAMES.index(f"{finger}_{k}") for finger in _FINGERS for k in range(3)))
MANO_JOINTS = (
    "wrist",
    *(f"{'pinky' if finger == 'little' else finger}{k}" for finger in _FINGERS for k in (1, 2, 3)),
)
"""The 16 joints in MANO's order."""
MANO_PARENTS = tuple(-1 if JOINT_PARENTS[ours] < 0 else _OURS.index(JOINT_PARENTS[ours]) for ours in _OURS)
"""Number (16,) of the joint before each, -1 for the wrist."""


TEMPLATE: Array = np.radians(
    [
        *(-10.0, -24.0, 21.0, 0.0),  # thumb: abduction, then three flexions; the last one is not known from joints
        *(4.0, -7.0, 10.0, -5.0),
        *(-10.0, -3.0, 6.0, -4.0),
        *(-15.0, -4.0, 8.0, -15.0),
        *(-34.0, 0.0, 2.0, -10.0),
    ]
)
"""Finger angles (20,) that give our bones the directions of the template's, within 6 degrees.

They were fitted to the joints of the right hand's template. A flat hand differs by up to 36 degrees.
"""


def mano_axes(mirror: float) -> Array:
    """Return MANO's axes (3, 3) in the palm's frame.

    mirror: +1 for a right hand, -1 for a left one.

    x points from the fingers to the wrist of a right hand, and the other way for a left one. y points out of the back
    of the hand, and z to the side of the thumb.
    """
    return np.array([[0.0, 0.0, mirror], [-mirror, 0.0, 0.0], [0.0, -1.0, 0.0]])


def write(track: JointTrack, path: Path) -> None:
    """Write the parameters of each frame as npz, or as JSON if `path` ends in .json.

    Raises:
        InputError: if the file cannot be written.
    """
    parameters = mano_parameters(track)
    if path.suffix.lower() == ".json":
        lists = {
            name: _without_nan(value) if isinstance(value, np.ndarray) else value for name, value in parameters.items()
        }
        write_atomic(path, exact_json_text(lists) + "\n")
        return
    arrays: dict[str, Any] = {name: np.asarray(value) for name, value in parameters.items()}
    with replace_atomically(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, **arrays)


def mano_parameters(track: JointTrack) -> dict[str, Any]:
    """Return the contents of the file by name; rows without a pose are NaN.

    `global_orient` (T, 3) and `hand_pose` (T, 45) are rotations, axis times angle, rad. `transl` (T, 3) is the wrist
    and `rest_joints` (16, 3) are the joints at rest from the wrist, metres.
    """
    rest = RestSkeleton.of(HandModel(track.hand), mano_axes(track.hand.mirror), TEMPLATE)
    posed, frames = track.posed, len(track.poses)
    vectors, wrist = np.full((frames, 16, 3), np.nan), np.full((frames, 3), np.nan)
    if posed.any():
        rotations = rest.rotations(track.poses[posed])[:, list(_OURS)]
        vectors[posed] = quaternion_log(quaternion_from_matrix(rotations))
        wrist[posed] = rest.model.wrist(track.poses[posed])
    return {
        "side": track.hand.side,
        "joint_names": list(MANO_JOINTS),
        "parents": list(MANO_PARENTS),
        "rest_joints": rest.joints[list(_OURS)],
        "flat_hand_mean": True,
        "frame": track.frame,
        "index": track.index,
        "timestamps": track.timestamps,
        "status": [status.value for status in track.status],
        "confidence": track.confidence,
        "global_orient": vectors[:, 0],
        "hand_pose": vectors[:, 1:].reshape(frames, 45),
        "transl": wrist,
        "betas": np.zeros(10),
    }


def _without_nan(array: Any) -> list[Any]:
    """Return nested lists of an array; a row with NaN is None."""
    rows = array.reshape(len(array), -1)
    known = np.isfinite(rows).all(axis=1)
    return [value if here else None for value, here in zip(array.tolist(), known, strict=True)]
