"""Annotations: blank keypoints are unknown, everything else is a number."""

from pathlib import Path

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.recording import open_sequence
from tests.support.recordings import TIMES, joints_at, write_sample


def change_cells(path: Path, row: int, cells: dict[int, str]) -> None:
    """Replace cells in a row, from 1, of a CSV file."""
    lines = path.read_text().splitlines()
    fields = lines[row].split(",")
    for column, text in cells.items():
        fields[column] = text
    lines[row] = ",".join(fields)
    path.write_text("\n".join(lines) + "\n")


@pytest.mark.parametrize("blank", ["", " ", "nan", "NaN"])
def test_a_keypoint_with_a_blank_cell_is_unknown(tmp_path: Path, blank: str) -> None:
    folder = write_sample(tmp_path / "sample")
    change_cells(folder / "joints.csv", 2, {4: blank, 5: blank, 6: blank, 10: blank})
    change_cells(folder / "joints.csv", 4, dict.fromkeys(range(1, 64), blank))
    truth = open_sequence(folder).ground_truth
    assert truth is not None
    assert truth.joints is not None
    expected = np.array([joints_at(index) for index in range(len(TIMES))])
    expected[1, [1, 3]], expected[3] = np.nan, np.nan
    np.testing.assert_array_equal(truth.joints, expected)
    last = truth.keypoints_at(TIMES[3])
    assert last is not None
    assert np.isnan(last).all()


@pytest.mark.parametrize(
    ("table", "cells", "message"),
    [
        ("joints.csv", {0: ""}, "line 3: expected a timestamp and 63 numbers or blanks"),
        ("joints.csv", {4: "inf"}, "line 3: expected a timestamp and 63 numbers or blanks"),
        ("joints.csv", {4: "1_0"}, "line 3: expected a timestamp and 63 numbers or blanks"),
        ("joints.csv", {4: "9" * 8000}, "line 3: expected a timestamp and 63 numbers or blanks"),
        ("hand_poses.csv", {4: ""}, "line 3: expected 28 finite numbers"),
        ("hand_poses.csv", {4: "nan"}, "line 3: expected 28 finite numbers"),
    ],
)
def test_other_cells_are_rejected(tmp_path: Path, table: str, cells: dict[int, str], message: str) -> None:
    folder = write_sample(tmp_path / "sample")
    change_cells(folder / table, 2, cells)
    with pytest.raises(InputError, match=message):
        open_sequence(folder)
