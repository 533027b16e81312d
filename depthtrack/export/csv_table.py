"""Export to CSV: a row a frame with pose and keypoints, empty cells if there is no pose."""

import csv
from pathlib import Path

import numpy as np

from depthtrack.export.joint_track import JointTrack
from depthtrack.files import replace_atomically
from depthtrack.hand.pose import POSE_NAMES
from depthtrack.recording.ground_truth import JOINTS_HEADER
from depthtrack.recording.run_rows import SPREAD_COLUMNS, VISIBILITY_COLUMNS

HEADER = (
    *("index", "timestamp", "status", "energy", "agreement", "confidence"),
    *VISIBILITY_COLUMNS,
    *POSE_NAMES,
    *JOINTS_HEADER[1:],
    *SPREAD_COLUMNS,
)
"""Columns: figures of a run's row, the 27 pose values, x, y, z of each keypoint, then the spread of each.

Keypoints are named as in a recording's `joints.csv`.
"""


def write(track: JointTrack, path: Path) -> None:
    """Write a track; numbers read back bitwise equal.

    Raises:
        InputError: if the file cannot be written.
    """
    with replace_atomically(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(HEADER)
        for row, index in enumerate(track.index):
            figures = [track.energy[row], track.agreement[row], track.confidence[row], *track.visibility[row]]
            numbers = [*figures, *track.poses[row], *track.keypoints[row].ravel(), *track.spread[row]]
            table.writerow([int(index), float(track.timestamps[row]), track.status[row], *map(_cell, numbers)])


def _cell(value: float) -> str:
    return repr(float(value)) if np.isfinite(value) else ""
