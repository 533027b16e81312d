"""Reading of a recording's annotations, `hand_poses.csv`, `joints.csv` and `hand.json`.

A keypoint with a blank cell in `joints.csv` is unknown.
"""

import math
from array import array
from pathlib import Path

import numpy as np

from depthtrack.errors import InputError
from depthtrack.files import read_lines
from depthtrack.hand.kinematics import KEYPOINT_NAMES
from depthtrack.hand.pose import ORIENTATION, POSE_NAMES
from depthtrack.hand.shape import HandShape
from depthtrack.number_text import parse_numbers, parse_numbers_or_blanks
from depthtrack.recording.sequence import GroundTruth
from depthtrack.types import Array

POSES_FILE, JOINTS_FILE, HAND_FILE = "hand_poses.csv", "joints.csv", "hand.json"
QUATERNION_TOLERANCE = 1e-3
"""Largest difference from 1 of a quaternion's length: rounding to a few digits causes less."""
MAX_TABLE_BYTES = 1 << 28
"""Largest table read, which holds hours of ground truth."""
POSES_HEADER = ("timestamp", *POSE_NAMES)
JOINTS_HEADER = ("timestamp", *(f"{name}_{axis}" for name in KEYPOINT_NAMES for axis in "xyz"))


def read_ground_truth(folder: Path, hand: HandShape | None) -> GroundTruth | None:
    """Return the annotations in `folder` of frames that show `hand`, or None without any.

    Raises:
        InputError: if a table is malformed.
    """
    poses = _read_table(folder / POSES_FILE, POSES_HEADER)
    joints = _read_table(folder / JOINTS_FILE, JOINTS_HEADER, blanks=True)
    tables = [table for table in (poses, joints) if table is not None]
    if not tables:
        return None
    if poses is not None and joints is not None and not _same_times(poses[:, 0], joints[:, 0]):
        raise InputError(f"{folder}: {POSES_FILE} and {JOINTS_FILE} must annotate the same timestamps, line by line")
    if poses is not None:
        lengths = np.linalg.norm(poses[:, 1:][:, ORIENTATION], axis=1)
        if np.any(np.abs(lengths - 1) > QUATERNION_TOLERANCE):
            worst = int(np.argmax(np.abs(lengths - 1)))
            raise InputError(
                f"{folder / POSES_FILE}: quaternions (qw, qx, qy, qz) must have length 1, found {lengths[worst]:.4g}"
                f" at timestamp {poses[worst, 0]}"
            )
    return GroundTruth(
        timestamps=tables[0][:, 0],
        poses=None if poses is None else poses[:, 1:],
        joints=None if joints is None else _joints(joints[:, 1:]),
        hand=hand,
    )


def _joints(cells: Array) -> Array:
    """Return keypoints (T, 21, 3); one with an unknown coordinate is unknown."""
    joints = cells.reshape(-1, len(KEYPOINT_NAMES), 3)
    joints[np.isnan(joints).any(axis=-1)] = np.nan
    return joints


def _same_times(a: Array, b: Array) -> bool:
    return len(a) == len(b) and bool(np.all(np.abs(a - b) < 1e-6))


def read_hand(folder: Path) -> HandShape | None:
    """Return the hand of `hand.json` in `folder`, or None without that file.

    Raises:
        InputError: if the file is malformed.
    """
    path = folder / HAND_FILE
    return HandShape.from_json(path) if path.exists() else None


def _read_table(path: Path, header: tuple[str, ...], blanks: bool = False) -> Array | None:
    """Return the rows (T, len(header)) of a CSV by increasing time; None without a file.

    blanks: whether cells may be blank, which is NaN.
    """
    if not path.exists():
        return None
    lines = read_lines(path, MAX_TABLE_BYTES)
    found = next(lines, "").strip().split(",")
    if tuple(found) != header:
        raise InputError(
            f"{path}: the header must be '{header[0]},{header[1]},...,{header[-1]}', found {_start(found)}"
        )
    # A flat array of doubles: a list of Python floats would take several times the file's size.
    values, last = array("d"), -math.inf
    for number, line in enumerate(lines, start=2):
        fields = line.strip().split(",")
        row = _numbers(fields, blanks)
        if len(row) != len(header):
            what = f"a timestamp and {len(header) - 1} numbers or blanks" if blanks else f"{len(header)} finite numbers"
            raise InputError(f"{path}, line {number}: expected {what}, found {_start(fields)}")
        if row[0] <= last:
            raise InputError(f"{path}, line {number}: timestamps must increase, found {row[0]} after {last}")
        values.extend(row)
        last = row[0]
    if not values:
        raise InputError(f"{path} must hold rows below its header, found none: delete the file if nothing is annotated")
    return np.array(values).reshape(-1, len(header))


def _numbers(fields: list[str], blanks: bool) -> list[float]:
    """Return the fields as numbers, NaN if blank; an empty list if one cannot be in a table."""
    try:
        row = parse_numbers_or_blanks(fields) if blanks else parse_numbers(fields)
    except ValueError:
        return []
    known = map(math.isfinite, row) if not blanks else [math.isfinite(row[0]), not any(map(math.isinf, row))]
    return row if all(known) else []


def _start(fields: list[str]) -> str:
    return f"{len(fields)} fields beginning with {','.join(fields)[:60]!r}"
