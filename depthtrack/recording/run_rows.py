"""Rows of `poses.csv` in a run folder: one frame each, also of earlier layouts."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from depthtrack.errors import InputError
from depthtrack.hand.kinematics import KEYPOINT_NAMES
from depthtrack.hand.pose import FINGERS, ORIENTATION, POSE_NAMES, POSE_SIZE
from depthtrack.number_text import parse_numbers, parse_whole_number
from depthtrack.recording.branches import Branch, read_branches
from depthtrack.recording.run_tables import header_of, read_table
from depthtrack.recording.sequences.tum_lists import MAX_FRAMES
from depthtrack.recording.status import Status
from depthtrack.types import Array

_EARLIER_COLUMNS = ("index", "timestamp", "status", "energy", "confidence", *POSE_NAMES)
"""Columns of runs whose confidence was the agreement of silhouettes."""
VISIBILITY_COLUMNS = tuple(f"{finger}_visible" for finger in FINGERS)
SPREAD_COLUMNS = tuple(f"{point}_spread" for point in KEYPOINT_NAMES)
_COLUMNS_WITHOUT_SPREAD = (*_EARLIER_COLUMNS[:4], "agreement", "confidence", *VISIBILITY_COLUMNS, *POSE_NAMES)
ROW_COLUMNS = (*_COLUMNS_WITHOUT_SPREAD, *SPREAD_COLUMNS)
FORWARD_FILE = "forward.csv"
"""The rows before poses of the backward pass replaced some of them."""
UNKNOWN_VISIBILITY = (math.nan,) * len(FINGERS)
UNKNOWN_SPREAD = (math.nan,) * len(KEYPOINT_NAMES)
_LARGEST = 100.0
"""Bound on the numbers of a pose, metres and radians."""
_LATEST = 1e12
"""Bound on timestamps, seconds."""
_UNIT_TOLERANCE = 1e-3


@dataclass(frozen=True)
class RunRow:
    """One frame of a run.

    timestamp: seconds.
    energy: of the pose; NaN without a pose.
    agreement: of the rendered and the observed silhouette, 0 to 1.
    pose: (27,) metres, quaternion, radians, camera frame; None if no hand was observed.
    confidence: probability that the largest joint error is below 20 mm; NaN if unknown.
    visibility: share of each finger that is visible, 0 to 1; NaN if unknown.
    spread: distance (21,) of the keypoints from the truth that about 68 % stay below, metres; NaN if unknown.
    branches: alternatives to the pose.
    """

    index: int
    timestamp: float
    status: Status
    energy: float
    agreement: float
    pose: Array | None
    confidence: float = math.nan
    visibility: tuple[float, ...] = UNKNOWN_VISIBILITY
    spread: tuple[float, ...] = UNKNOWN_SPREAD
    branches: tuple[Branch, ...] = ()


def read_rows(folder: Path, name: str = "poses.csv") -> list[RunRow]:
    """Return the complete rows of a table of poses; a truncated last row is left out.

    Raises:
        InputError: if a row is malformed, or holds values that no tracker writes.
    """
    path = folder / name
    header = header_of(path)
    columns = header if header in (_EARLIER_COLUMNS, _COLUMNS_WITHOUT_SPREAD) else ROW_COLUMNS
    branches, rows = read_branches(folder / "branches.csv"), list[RunRow]()
    for number, cells in enumerate(read_table(path, columns), start=2):
        try:
            row = _row(dict(zip(columns, cells, strict=True)))
            rows.append(replace(row, branches=branches.get(row.index, ())))
        except (ValueError, IndexError) as error:
            raise InputError(
                f"{path}, line {number}: expected {len(columns)} values of a frame: {error!s:.120}"
            ) from error
        if (reason := _fault(rows[-1])) is not None:
            raise InputError(f"{path}, frame {rows[-1].index}: {reason}")
        if len(rows) > 1 and rows[-1].index <= (before := rows[-2].index):
            raise InputError(f"{path}, line {number}: expected a frame after {before}, found {rows[-1].index}")
    return rows


def _row(named: Mapping[str, str]) -> RunRow:
    """Return the row of cells by column, also of earlier runs. Raises ValueError."""

    def numbers(columns: Sequence[str]) -> tuple[float, ...]:
        return tuple(parse_numbers([named.get(column, "nan") for column in columns]))

    index = parse_whole_number(named["index"])
    if not 0 <= index < MAX_FRAMES:
        raise ValueError(f"frames are numbered from 0 to {MAX_FRAMES - 1}")
    today = "agreement" in named
    timestamp, energy, agreement, confidence = numbers(
        ("timestamp", "energy", "agreement" if today else "confidence", "confidence" if today else "")
    )
    has_pose = any(named[column] for column in POSE_NAMES)
    return RunRow(
        index,
        timestamp,
        Status(named["status"]),
        energy,
        agreement,
        np.array(numbers(POSE_NAMES)) if has_pose else None,
        confidence,
        numbers(VISIBILITY_COLUMNS),
        numbers(SPREAD_COLUMNS),
    )


def _fault(row: RunRow) -> str | None:
    """Return the reason why no tracker writes such a row; None if the row is valid."""
    if not abs(row.timestamp) < _LATEST:  # false for NaN
        return f"the timestamp must be seconds below {_LATEST:g}, found {row.timestamp:.6g}"
    shares = np.array([row.confidence, *row.visibility])
    if len(outside := shares[(shares < 0) | (shares > 1)]):
        return f"confidence and visibility must be shares from 0 to 1, found {outside[0]:.6g}"
    spread = np.array(row.spread)
    if len(outside := spread[(spread < 0) | (spread > _LARGEST)]):
        return f"a spread must be metres from 0 to {_LARGEST:g}, found {outside[0]:.6g}"
    if row.pose is None:
        return None
    if not np.all(np.abs(row.pose) <= _LARGEST):
        return f"a pose must be numbers up to {_LARGEST:g} (metres, radians), or absent"
    length = np.linalg.norm(row.pose[ORIENTATION])
    return None if abs(length - 1) <= _UNIT_TOLERANCE else f"the quaternion must have length 1, found {length:.6g}"


def row_cells(row: RunRow) -> list[str]:
    """Return the cells of a row."""
    pose = [""] * POSE_SIZE if row.pose is None else [repr(float(x)) for x in row.pose]
    shares = map(repr, (row.energy, row.agreement, row.confidence, *row.visibility))
    return [str(row.index), repr(row.timestamp), row.status, *shares, *pose, *map(repr, row.spread)]
