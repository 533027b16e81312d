"""Postures in CSV files with columns of finger angles or joint positions.

- The 20 angles of the pose vector, `thumb_cmc_abduction` to `little_dip_flexion`, are radians; with the suffix `_deg`
  they are degrees. `hand_poses.csv` of a recording and `poses.csv` of a run folder are such files.
- Joints of one hand, `wrist_x` to `little_tip_z`, are metres, centimetres or millimetres, as in `joints.csv` of a
  recording. Absent columns and fields that are empty or `nan` are unknown joints.

Other columns are ignored.
"""

import csv
from array import array
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from depthtrack.errors import InputError
from depthtrack.files import read_lines
from depthtrack.hand.kinematics import KEYPOINT_NAMES
from depthtrack.hand.pose import ANGLE_NAMES
from depthtrack.number_text import parse_numbers_or_blanks
from depthtrack.posture_databases.joint_postures import postures_of_joints
from depthtrack.posture_databases.posture_set import MAX_BYTES, PostureSet, check_angles, check_count
from depthtrack.types import Array

FILES_IN_FOLDERS = ("hand_poses.csv", "poses.csv", "joints.csv")
"""The files of a recording or run folder; the first that exists is read."""
DEGREE_NAMES = tuple(f"{name}_deg" for name in ANGLE_NAMES)
_JOINT_COLUMNS = tuple(f"{name}_{axis}" for name in KEYPOINT_NAMES for axis in "xyz")
_LARGEST = 1e6


def matches(path: Path) -> bool:
    """Return whether `path` is a CSV file, or a folder with one of `FILES_IN_FOLDERS`."""
    return (path.suffix.lower() == ".csv" and path.is_file()) or any(
        (path / name).is_file() for name in FILES_IN_FOLDERS
    )


def read(path: Path) -> PostureSet:
    """Return the postures of the rows that have them.

    Raises:
        InputError: if the columns are unknown or a row is malformed.
    """
    if path.is_dir():
        path = next(path / name for name in FILES_IN_FOLDERS if (path / name).is_file())
    lines = read_lines(path, MAX_BYTES)
    header = [name.strip() for name in next(lines, "").split(",")]
    for names, scale in ((ANGLE_NAMES, 1.0), (DEGREE_NAMES, np.pi / 180)):
        if set(names) <= set(header):
            angles = _columns(path, lines, [header.index(name) for name in names])
            partly = np.isnan(angles).any(axis=1)
            if np.isnan(angles[partly]).all():
                return PostureSet(check_angles(path, angles[~partly] * scale))
            raise InputError(f"{path}: a row must give all {len(names)} angles, or none of them")
    if any(name in header for name in _JOINT_COLUMNS):
        present = [k for k, name in enumerate(_JOINT_COLUMNS) if name in header]
        values = _columns(path, lines, [header.index(_JOINT_COLUMNS[k]) for k in present])
        joints = np.full((len(values), len(_JOINT_COLUMNS)), np.nan)
        joints[:, present] = values
        return postures_of_joints(path, joints.reshape(-1, len(KEYPOINT_NAMES), 3))
    raise InputError(
        f"{path}: expected columns {ANGLE_NAMES[0]} ... {ANGLE_NAMES[-1]} in radians, the same with _deg, or"
        f" {_JOINT_COLUMNS[0]} ... {_JOINT_COLUMNS[-1]}, found {','.join(header)[:60]!r}"
    )


def _columns(path: Path, lines: Iterator[str], chosen: list[int]) -> Array:
    """Return numbers (N, columns), NaN for an empty field."""
    values, count = array("d"), 0
    try:
        for fields in csv.reader(lines):
            if fields:
                count += 1
                check_count(path, count)
                values.extend(parse_numbers_or_blanks([fields[k] for k in chosen]))
    except (ValueError, IndexError, csv.Error):
        raise InputError(f"{path}, row {count}: expected numbers in the columns that the header names") from None
    table = np.array(values).reshape(count, len(chosen))
    if np.any(np.abs(table) > _LARGEST):
        raise InputError(f"{path}: expected numbers up to {_LARGEST:g}, found larger ones")
    return table
