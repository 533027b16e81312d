"""Ground truth beside the images: `hand_poses.csv`, `joints.csv` and `hand.json`."""

import csv
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthtrack.errors import InputError
from depthtrack.hand.kinematics import KEYPOINT_NAMES
from depthtrack.hand.pose import ORIENTATION, POSE_NAMES
from depthtrack.hand.shape import HandShape
from depthtrack.recording.lists import check_size, read_text
from depthtrack.recording.sequence import GroundTruth

POSES_FILE, JOINTS_FILE, HAND_FILE = "hand_poses.csv", "joints.csv", "hand.json"
POSES_HEADER = ("timestamp", *POSE_NAMES)
JOINTS_HEADER = ("timestamp", *(f"{name}_{axis}" for name in KEYPOINT_NAMES for axis in "xyz"))


def read_ground_truth(folder: Path) -> GroundTruth | None:
    """What `folder` knows, or None where it has none of the files. Raises InputError for a malformed one."""
    poses = _read_table(folder / POSES_FILE, POSES_HEADER)
    joints = _read_table(folder / JOINTS_FILE, JOINTS_HEADER)
    hand = _read_hand(folder / HAND_FILE)
    tables = [table for table in (poses, joints) if table is not None]
    if not tables and hand is None:
        return None
    if len(tables) == 2 and not np.array_equal(tables[0][:, 0], tables[1][:, 0]):
        raise InputError(f"{folder}: {POSES_FILE} and {JOINTS_FILE} must annotate the same timestamps, line by line")
    if poses is not None:
        lengths = np.linalg.norm(poses[:, 1:][:, ORIENTATION], axis=1)
        if np.any(np.abs(lengths - 1) > 1e-3):
            worst = int(np.argmax(np.abs(lengths - 1)))
            raise InputError(
                f"{folder / POSES_FILE}: quaternions (qw, qx, qy, qz) must have length 1, found {lengths[worst]:.4g}"
                f" at timestamp {poses[worst, 0]}"
            )
    return GroundTruth(
        timestamps=tables[0][:, 0] if tables else np.zeros(0),
        poses=None if poses is None else poses[:, 1:],
        joints=None if joints is None else joints[:, 1:].reshape(-1, len(KEYPOINT_NAMES), 3),
        hand=hand,
    )


def _read_hand(path: Path) -> HandShape | None:
    if not path.exists():
        return None
    check_size(path, 1 << 20)
    return HandShape.from_json(path)


def _read_table(path: Path, header: tuple[str, ...]) -> NDArray[np.float64] | None:
    """Rows (T, len(header)) of a CSV with that header, finite and in order of time; None where the file is absent."""
    if not path.exists():
        return None
    rows = csv.reader(read_text(path).splitlines())
    found = tuple(next(rows, []))
    if found != header:
        raise InputError(
            f"{path}: the header must be '{header[0]},{header[1]},...,{header[-1]}', found {_start(found)}"
        )
    table: list[NDArray[np.float64]] = []
    for number, row in enumerate(rows, start=2):
        try:
            values = np.array(row, dtype=np.float64)
        except ValueError:
            values = np.zeros(0)
        if len(values) != len(header) or not np.all(np.isfinite(values)):
            raise InputError(
                f"{path}, line {number}: expected {len(header)} finite numbers, found {_start(tuple(row))}"
            )
        if table and values[0] <= table[-1][0]:
            raise InputError(f"{path}, line {number}: timestamps must increase, found {values[0]} after {table[-1][0]}")
        table.append(values)
    if not table:
        raise InputError(f"{path} holds no row below its header: delete the file if nothing is annotated")
    return np.array(table)


def _start(fields: tuple[str, ...]) -> str:
    return f"{len(fields)} fields beginning with {','.join(fields)[:60]!r}"
