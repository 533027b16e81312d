"""Joint positions in NumPy's `.npz`, the format of tracking devices' recordings.

joints: (N, 5, 4, 3) thumb to little finger, base to tip; or (N, 20, 3), or (N, 21, 3) with the wrist first; metres,
    centimetres or millimetres.
start, length: (tracks,) optional, the rows of each track of one hand.
right: (tracks,) optional, whether it is a right hand.
name: (tracks,) optional, the track's name.

Without `start` and `length` all joints belong to one hand, and its side is determined from them.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthtrack.errors import InputError
from depthtrack.files import check_size
from depthtrack.hand.kinematics import KEYPOINT_NAMES
from depthtrack.hand.shape import Side
from depthtrack.posture_databases.joint_postures import postures_of_joints
from depthtrack.posture_databases.posture_set import MAX_BYTES, PostureSet, check_count
from depthtrack.recording.numpy_arrays import read_arrays
from depthtrack.types import Array

MAX_TRACKS = 10_000


def matches(path: Path) -> bool:
    """Return whether the file name ends in .npz."""
    return path.suffix.lower() == ".npz" and path.is_file()


def read(path: Path) -> PostureSet:
    """Return the postures of all tracks, with sizes measured on each hand separately.

    Raises:
        InputError: if the file is damaged or holds no joints of a hand.
    """
    check_size(path, MAX_BYTES)
    arrays = read_arrays(path, ("joints", "start", "length", "right", "name"))
    if "joints" not in arrays:
        raise InputError(f"{path}: expected an array 'joints' (N, 5, 4, 3), found none")
    keypoints = _keypoints(path, arrays["joints"])
    tracks = _tracks(path, arrays, len(keypoints))
    sets = [postures_of_joints(path, keypoints[track.rows], track.side) for track in tracks]
    counts = [len(one.angles) for one in sets]
    return PostureSet(
        angles=np.concatenate([one.angles for one in sets]),
        misfit=float(np.average([one.misfit or 0.0 for one in sets], weights=counts)),
        tracks=np.repeat([track.name for track in tracks], counts),
    )


@dataclass(frozen=True)
class _Track:
    """The rows of one hand's joints, its side if known, and its name."""

    rows: slice
    side: Side | None
    name: str


def _keypoints(path: Path, joints: NDArray[Any]) -> Array:
    """Return keypoints (N, 21, 3) in the file's unit, NaN for a wrist that the file lacks."""
    count = len(KEYPOINT_NAMES)
    shapes = ((5, 4, 3), (count - 1, 3), (count, 3))
    if joints.shape[1:] not in shapes or not len(joints) or joints.dtype.kind not in "fiu":
        raise InputError(
            f"{path}: 'joints' must be numbers (N, 5, 4, 3), (N, 20, 3) or (N, 21, 3),"
            f" found {joints.dtype} {joints.shape}"
        )
    check_count(path, len(joints))
    keypoints = np.full((len(joints), count, 3), np.nan)
    flat = joints.reshape(len(joints), -1, 3)
    keypoints[:, count - flat.shape[1] :] = flat
    if np.any(np.abs(keypoints) > 1e6):
        raise InputError(f"{path}: 'joints' must lie within a kilometre of their origin")
    return keypoints


def _tracks(path: Path, arrays: dict[str, NDArray[Any]], count: int) -> list[_Track]:
    start, length = arrays.get("start", np.array([0])), arrays.get("length", np.array([count]))
    right, name = arrays.get("right"), arrays.get("name")
    if start.ndim != 1 or start.shape != length.shape or not 1 <= len(start) <= MAX_TRACKS:
        raise InputError(
            f"{path}: 'start' and 'length' must have the same shape (tracks,) of 1 to {MAX_TRACKS:,} tracks,"
            f" found {start.shape} and {length.shape}"
        )
    if start.dtype.kind not in "iu" or length.dtype.kind not in "iu":
        raise InputError(f"{path}: 'start' and 'length' must be whole numbers")
    check_count(path, sum(length.tolist()))
    if any(array is not None and array.shape != start.shape for array in (right, name)):
        raise InputError(f"{path}: 'right' and 'name' must have one element for each of the {len(start)} tracks")
    tracks = []
    for i, (first, frames) in enumerate(zip(start.tolist(), length.tolist(), strict=True)):
        if not 0 <= first < first + frames <= count:
            raise InputError(f"{path}: each track must lie within the {count} rows, found {first}+{frames}")
        side: Side | None = None if right is None else "right" if right[i] else "left"
        label = "" if name is None else str(name[i])
        tracks.append(_Track(slice(first, first + frames), side, label if label.isprintable() else ""))
    return tracks
