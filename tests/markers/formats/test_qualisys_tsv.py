"""Test Qualisys TSV: header, gaps, damage."""

from pathlib import Path

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.markers.formats.registry import read_capture

HEADER = (
    "NO_OF_FRAMES\t3",
    "NO_OF_CAMERAS\t7",
    "NO_OF_MARKERS\t2",
    "FREQUENCY\t100",
    "DATA_INCLUDED\t3D",
    "MARKER_NAMES\tthumb\tindex\t",
    "TRAJECTORY_TYPES\tMeasured\tMixed\t",
    "Frame\tTime\tthumb X\tthumb Y\tthumb Z\tindex X\tindex Y\tindex Z\t",
)
ROWS = ("1\t0.00\t1\t2\t3\t4\t5\t6", "2\t0.01\t0.000\t0.000\t0.000\t4\t5\t6", "3\t0.02\t\t\t\tnan\tnan\tnan")


def saved(tmp_path: Path, *lines: str) -> Path:
    path = tmp_path / "capture.tsv"
    path.write_text("\r\n".join(lines) + "\r\n", newline="")
    return path


def test_numbers_labels_and_gaps(tmp_path: Path) -> None:
    capture = read_capture(saved(tmp_path, *HEADER, *ROWS))
    assert (capture.rate, capture.labels, len(capture)) == (100, ("thumb", "index"), 3)
    np.testing.assert_allclose(capture.positions[0], [[0.001, 0.002, 0.003], [0.004, 0.005, 0.006]])
    np.testing.assert_array_equal(np.isnan(capture.positions).all(axis=-1), [[0, 0], [1, 0], [1, 1]])
    assert capture.notes == ("1 samples are 0 0 0 and are read as gaps",)


def test_rows_may_have_no_frame_and_time(tmp_path: Path) -> None:
    rows = ["\t".join(row.split("\t")[2:]) for row in ROWS]
    assert len(read_capture(saved(tmp_path, *HEADER[:-1], *rows))) == 3


def test_a_wrong_count_and_surplus_labels_are_noted(tmp_path: Path) -> None:
    header = [line.replace("\tindex\t", "\tindex\tring") for line in HEADER]
    capture = read_capture(saved(tmp_path, *header, *ROWS[:2]))
    assert capture.labels == ("thumb", "index")
    assert any("states '3' frames, the file has 2" in note for note in capture.notes)
    assert any("1 labels have no trajectory" in note for note in capture.notes)


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ("FREQUENCY\t100", "FREQUENCY\t-1", "line 4: FREQUENCY must be a number above 0"),
        ("FREQUENCY\t100", "", "FREQUENCY must be"),
        ("NO_OF_MARKERS\t2", "NO_OF_MARKERS\t999999", "trajectories, found 999,999"),
        ("DATA_INCLUDED\t3D", "DATA_INCLUDED\t6D", "line 5: DATA_INCLUDED must be 3D"),
        ("MARKER_NAMES", "NAMES", "MARKER_NAMES"),
        ("2\t0.01\t0.000", "1\t0.01\t0.000", "line 10: frames must increase"),
        ("2\t0.01\t0.000", "2\t0.01\t0.0a", "line 10, cell 3"),
        ("\tnan\tnan\tnan", "\tnan", "line 11: expected 8 cells"),
    ],
)
def test_damage_is_reported_with_its_line(tmp_path: Path, old: str, new: str, match: str) -> None:
    text = "\n".join((*HEADER, *ROWS))
    assert old in text
    with pytest.raises(InputError, match=match):
        read_capture(saved(tmp_path, *text.replace(old, new).split("\n")))
